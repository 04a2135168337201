"""Summary of a screening for mail and radio: earthquake, five numbers, worst pairs, actions."""

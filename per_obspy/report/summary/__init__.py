"""One page for mail and radio: what happened, five numbers, the worst pairs, what to do first."""

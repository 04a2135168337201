"""Results as layers for a map and for a spreadsheet."""

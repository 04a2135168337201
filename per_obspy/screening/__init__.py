"""Ground motion at a pair of buildings, the demand on its gap, and the risk table of a region."""

"""Watched earthquakes: their list, their state, the runs that are due, and their revisions."""

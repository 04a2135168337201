"""Watched earthquakes: lists, states, due runs and revisions of results."""

"""Rows of neighbouring buildings, found from pairs."""

"""Advance many rows of buildings that hit each other, many rows per call."""

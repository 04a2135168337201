"""Advance rows of structures from impact to impact, one row at a time."""

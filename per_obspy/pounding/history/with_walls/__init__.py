"""Rows of structures that end at walls: seismically isolated buildings and bridges."""

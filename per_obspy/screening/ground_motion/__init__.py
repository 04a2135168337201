"""Assign stations to pairs and interpolate ground motion between stations."""

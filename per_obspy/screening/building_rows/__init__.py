"""Exact histories of rows of buildings, and one row per building."""

"""Earthquakes among the records of a folder, and the one to screen."""

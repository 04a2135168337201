"""Rows of buildings as a stage of a run."""

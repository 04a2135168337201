"""Figures and maps of a run. Only this room draws."""

"""Make pairs of adjacent buildings from building footprints."""

"""Fetch records, station metadata and events from FDSN web services."""

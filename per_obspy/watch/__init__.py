"""Unattended operation: watching for earthquakes, revisions, status, notification."""

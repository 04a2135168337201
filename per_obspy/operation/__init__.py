"""Unattended operation: watching for earthquakes, status, notification."""

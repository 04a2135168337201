"""Operation: watch for earthquakes, report status, notify."""

"""Operation: watch for earthquakes, keep revisions, report status, notify."""

"""Work without a user: watch for earthquakes, keep revisions, report the state, notify people."""

"""Settings of operation: notification and the watcher."""

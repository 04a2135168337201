"""Commands of operation: status and the watcher."""

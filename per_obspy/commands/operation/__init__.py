"""Commands for unattended operation: log options, status and the watcher."""

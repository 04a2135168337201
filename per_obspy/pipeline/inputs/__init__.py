"""Arguments of a command: recognised by content, described, and made into a run."""

"""What the arguments of a command are: recognised by content, described, and made into a run."""

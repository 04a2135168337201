"""Resumable tasks of a run, one per station or chunk, on processes or a cluster."""

"""Parallel jobs, one per station or chunk of pairs, that resume after an interruption."""

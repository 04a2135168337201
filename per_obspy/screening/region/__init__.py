"""Sum risk over areas, compare it with observations and combine scenarios."""

"""Risk of a region: totals of areas, comparison with observations, several scenarios."""

"""Compute the probability of pounding of pairs."""

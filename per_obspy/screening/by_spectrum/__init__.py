"""Compute demands of pairs from a design spectrum or a ShakeMap."""

"""Compute demands of pairs from the record of their station."""

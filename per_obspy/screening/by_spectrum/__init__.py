"""Demand of pairs by a design spectrum or a ShakeMap."""

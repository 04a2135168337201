"""Demand of pairs by the record of their station."""

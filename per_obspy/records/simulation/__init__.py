"""Simulate the records of an earthquake by a stochastic point source."""

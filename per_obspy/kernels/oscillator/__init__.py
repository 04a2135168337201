"""Advance one oscillator exactly over a step of piecewise-linear ground acceleration."""

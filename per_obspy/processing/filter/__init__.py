"""Correct baselines and filter: polynomials, velocity segments and Butterworth corners."""

"""Evaluate closed-form formulas for many building pairs at once."""

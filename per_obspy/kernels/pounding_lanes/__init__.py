"""Advance many building pairs side by side, one pair per vector lane."""

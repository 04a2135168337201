"""Separate noise from signal: onset, windows, smoothing and signal-to-noise ratio."""

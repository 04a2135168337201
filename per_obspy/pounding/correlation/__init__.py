"""Correlate the displacements of two oscillators: white noise, ground spectra and records."""

"""Compute PER and response spectra of one record for blocks of oscillators."""

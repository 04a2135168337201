"""Find displacement and radius maxima of oscillators, one period and damping per pair."""

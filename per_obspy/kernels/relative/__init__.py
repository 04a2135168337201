"""Find the largest relative displacement of two oscillators."""

"""Replace yielding structures by equivalent linear ones."""

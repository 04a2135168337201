"""Stream to Stream: every step returns a new Stream and leaves its input as it was; ``chain`` puts them in order."""

"""Processing steps from Stream to new Stream; ``chain`` applies them in order."""

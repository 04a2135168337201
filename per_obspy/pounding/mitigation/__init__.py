"""Size the measures that prevent or soften pounding: damping, bumpers and links."""

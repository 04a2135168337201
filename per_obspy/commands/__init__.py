"""Commands of ``per-obspy``: each parses its arguments, calls one function, prints the result."""

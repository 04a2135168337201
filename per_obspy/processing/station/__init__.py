"""Assemble the traces of one station: merge, splice and pair components."""

"""Ranked tables in one file or in one file per cell: a reader of both, the writer of cells."""

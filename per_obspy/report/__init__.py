"""Figures, maps, page, layers and summaries of results."""

"""Integrate exact pounding histories of pairs and rows of structures."""

"""Rows of buildings as tables and blocks for the kernels."""

"""Parsing of agencies' text files: lines, number fields, blocks and header vocabulary."""

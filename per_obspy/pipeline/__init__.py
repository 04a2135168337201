"""
The stages of a run: stations from records, the risk table from stations and pairs, the report from the risk table.

Each stands on what the one before left in the output folder, so that it can be done again alone.
"""

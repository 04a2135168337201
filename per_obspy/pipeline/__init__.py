"""
Stages of a run: stations from records, the risk table from stations and pairs, then the report.

Each needs only what the one before left in the output folder, so that it can be done again alone.
"""

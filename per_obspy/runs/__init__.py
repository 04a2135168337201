"""
Stages of a run: stations from records, the risk table from stations and pairs, then the report.

Each stage reads the files of the stage before from the output folder, so that it can be
repeated alone.
"""

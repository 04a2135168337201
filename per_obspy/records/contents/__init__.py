"""Contents of a folder of records: its files, their metadata, one series of each channel."""

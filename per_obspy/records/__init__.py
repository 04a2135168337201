"""Sources of records: each gives Streams in m/s2 with coordinates and sensor azimuths."""

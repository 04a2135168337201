"""Where records come from: each source gives Streams in m/s2 with coordinates and sensor azimuths."""

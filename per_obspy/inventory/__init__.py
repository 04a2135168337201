"""Buildings and pairs: schema, readers, checks, periods, masses, participation, simulation."""

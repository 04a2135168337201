"""Buildings and pairs: schema, reading and checking, periods, masses, participation, simulated inventories."""

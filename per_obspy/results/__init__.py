"""Result tables on disk: risk, stations, buildings, totals, ensemble and their parts."""

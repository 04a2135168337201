"""The report as one HTML file that needs no network: first screen, map, table, details of pairs."""

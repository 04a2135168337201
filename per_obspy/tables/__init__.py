"""Read and write result tables: risk, totals, ensemble and their parts."""

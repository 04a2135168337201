"""One module per source of buildings: its columns, codes and units."""

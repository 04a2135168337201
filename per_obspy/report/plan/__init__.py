"""Order of visits to buildings after an earthquake: routes, and their files."""

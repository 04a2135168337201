"""From pairs to buildings and rows: contacts, chains, histories, and the tables of both."""

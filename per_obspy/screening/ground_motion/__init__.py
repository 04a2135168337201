"""Assignment of stations to pairs, and ground motion between stations."""

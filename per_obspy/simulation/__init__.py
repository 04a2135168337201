"""Made-up earthquakes with their records and stations, and made-up buildings around them."""

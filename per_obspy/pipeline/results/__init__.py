"""Results for people: summary, layers and workbook of every kind of screening."""

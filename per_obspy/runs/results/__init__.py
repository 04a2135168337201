"""Results to read: page, summary, layers and workbook of every kind of screening."""

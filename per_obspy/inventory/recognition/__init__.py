"""Recognise how a table is written: encoding, separator, decimal mark, headings, units."""

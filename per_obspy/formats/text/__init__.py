"""Parse the text files of strong-motion agencies: lines, number fields, blocks and header vocabulary."""

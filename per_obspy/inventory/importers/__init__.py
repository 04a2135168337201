"""Buildings of other sources under the names of the schema: tables of names, and readers."""

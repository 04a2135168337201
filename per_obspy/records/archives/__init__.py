"""Archives as folders: zip and tar, also inside each other."""

"""Records of the last hours from SeedLink servers, which archives may not have yet."""

"""Photos: files, pixels, colours, profiles, sizes."""

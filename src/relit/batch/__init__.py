"""Many photos over night: rows of a manifest, or pairs of two folders, in processes that may die."""

"""A change of light, made in a photo: where it is trusted, where it goes, how much of it."""

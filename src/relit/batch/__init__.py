"""Many pairs of photos: from two photos to a data set."""

"""The logarithmic total variation model: light and person of one photo."""

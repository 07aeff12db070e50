"""Names, defaults, ranges and help of every option, and lights by name."""

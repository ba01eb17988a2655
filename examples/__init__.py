"""Examples, numbered in the order in which they are best read."""

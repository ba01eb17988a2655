"""The centreline of a rope in one RGB-D frame, as a chain of nodes with standard deviations."""

"""Three-dimensional view of the cell."""

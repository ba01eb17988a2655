"""Limits of the depths that are drawn, and marks of the blocks of an image where they change."""

FAR = 1e6
"""Depth of a ray that hits nothing [m]."""
NEAR = 0.02
"""Least depth that is drawn [m]."""
BLOCK_SHIFT = 5
"""Logarithm to base 2 of the number of pixels of a row that are marked together."""
STILL = 1
"""Mark of a block in which what stands still has an edge, or shows nothing."""
DRAWN = 2
"""Mark of a block in which something has been drawn over what stands still."""

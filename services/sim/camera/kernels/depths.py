"""Limits of the depths that are drawn."""

FAR = 1e6
"""Depth of a ray that hits nothing [m]."""
NEAR = 0.02
"""Least depth that is drawn [m]."""

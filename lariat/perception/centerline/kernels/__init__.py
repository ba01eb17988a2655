"""Compiled Gauss-Newton fit of an inextensible chain to rays and ranges.

The unknowns are the positions of n nodes. Every sample is a ray, with or without a measured range
to the rope's surface. A ray constrains the axis laterally, perpendicular to ray and rope; a range,
perpendicular to the rope in the plane of both. Neither constrains the position along the rope. The
normal equations are banded: third differences couple four neighbouring nodes.
"""

"""Spacing constraint: the two ends keep their distance from each other (rule `spacing`).

It holds for the grips themselves and for all bodies of the ends: grippers, links and bases.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.safety.constraints.sphere_distance import Spheres, sphere_distances


def grip_distances(positions: Float64[np.ndarray, "m 2 3"]) -> Float64[np.ndarray, "m"]:
    """Return the distance between both grips at m poses [m]."""
    return np.linalg.norm(positions[:, 1] - positions[:, 0], axis=1)


def body_spacing_slack(left: Spheres, right: Spheres, keep_out: float) -> Float64[np.ndarray, "m"]:
    """Return the slack of the distance between the bodies of both ends at m poses [m].

    Args:
        left: Spheres that cover the left end.
        right: Spheres that cover the right end.
        keep_out: Least distance between their surfaces [m].
    """
    return sphere_distances(left, right) - keep_out

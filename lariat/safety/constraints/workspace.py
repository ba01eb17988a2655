"""Grips stay inside the workspace (rule `workspace`) and the rope's regions (rule `keep_in`)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, scene_distance

Corner = tuple[float, float, float]
"""Corner of a box in the world frame [m]."""


def workspace_slack(
    grips: Float64[np.ndarray, "m n 3"], workspace: tuple[Corner, Corner]
) -> Float64[np.ndarray, "m"]:
    """Return the least distance of n grips to the faces of a box, at m poses [m].

    Args:
        grips: Positions of the grips [m].
        workspace: Lowest and highest corner of the box [m].
    """
    low, high = np.array(workspace)
    return np.min(np.minimum(grips - low, high - grips), axis=(1, 2))


def region_slack(
    grips: Float64[np.ndarray, "m n 3"], regions: Sequence[Obstacle]
) -> Float64[np.ndarray, "m"]:
    """Return the least distance of n grips to the borders of regions, negative outside [m].

    Args:
        grips: Positions of the grips [m].
        regions: Regions to keep in; without any, the slack is infinite.
    """
    return np.min(scene_distance(grips, regions), axis=1, initial=np.inf)

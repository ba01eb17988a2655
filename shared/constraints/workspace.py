"""Workspace constraint: grips stay inside a box (rule `workspace`)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

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

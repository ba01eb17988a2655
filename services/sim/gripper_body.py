"""Body of a gripper in the simulated camera's images."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose


def gripper_body(grip: Pose, direction: float, radius: float, height: float) -> Obstacle:
    """Return the capsule that points from the grip away from the rope.

    Args:
        grip: Pose of the grip.
        direction: Direction of the body along the grip's z axis, +1 at the right end, -1 at the
            left one.
        radius: Radius of the capsule [m].
        height: Distance from the grip to the far end [m].
    """
    span = max(height - radius, 0.0)
    away = poses.rotate(grip.orientation, np.array([0.0, 0.0, direction]))
    return Obstacle(
        "capsule",
        tuple(grip.position + 0.5 * span * away),
        tuple(grip.orientation),
        radius=radius,
        height=span,
    )

"""Collision constraint: bodies keep their distance from obstacles (rules `keep_out`, `table`)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import signed_distance
from services.robot_gateway.constraints.obstacle_scene import ObstacleScene
from services.robot_gateway.constraints.slacks import Slacks

EXACT_SLACK = 0.05
"""Slack above which the distance to an obstacle's bounding sphere serves as a lower bound [m]."""


class CollisionConstraint:
    """Distance of spheres, which cover grippers and links, from the obstacles of a scene."""

    def __init__(self, keep_out: float) -> None:
        """Create the constraint without obstacles.

        Args:
            keep_out: Least distance of a body from a solid obstacle [m]. A half space, such as
                the table, may be touched.
        """
        self.keep_out = keep_out
        self.scene = ObstacleScene()

    def slacks(
        self, centres: Float64[np.ndarray, "m k 3"], radii: Float64[np.ndarray, "k"]
    ) -> Slacks:
        """Return the slacks of both rules for k spheres at m poses [m].

        A slack of at least `EXACT_SLACK` is a lower bound.

        Args:
            centres: Centres of the spheres in the world frame [m].
            radii: Radii of the spheres [m].
        """
        scene = self.scene
        if not len(radii):
            free = np.full(len(centres), np.inf)
            return {"keep_out": free, "table": free}
        table = [np.min(signed_distance(centres, o) - radii, axis=1) for o in scene.half_spaces]
        gaps = np.linalg.norm(centres[:, :, None] - scene.centres, axis=-1)
        slack = np.min(gaps - radii[:, None], axis=1) - scene.radii
        slack -= self.keep_out
        for k in np.flatnonzero(np.any(slack < EXACT_SLACK, axis=0)):
            exact = signed_distance(centres, scene.solids[k]) - radii
            slack[:, k] = np.min(exact, axis=1) - self.keep_out
        return {
            "keep_out": np.min(slack, axis=1, initial=np.inf),
            "table": np.min(table, axis=0) if table else np.full(len(centres), np.inf),
        }

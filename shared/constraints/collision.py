"""Collision constraint: bodies keep their distance from obstacles (rules `keep_out`, `table`)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import signed_distance
from shared.constraints.obstacle_scene import ObstacleScene
from shared.constraints.slacks import Slacks

EXACT_SLACK = 0.05
"""Slack above which the distance from an obstacle's bounding sphere to the box around the path
serves as a lower bound [m]."""


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
        if not len(radii):
            free = np.full(len(centres), np.inf)
            return {"keep_out": free, "table": free}
        table = [
            np.min(signed_distance(centres, o) - radii, axis=1) for o in self.scene.half_spaces
        ]
        return {
            "keep_out": self._solid_slack(centres, radii),
            "table": np.min(table, axis=0) if table else np.full(len(centres), np.inf),
        }

    def _solid_slack(
        self, centres: Float64[np.ndarray, "m k 3"], radii: Float64[np.ndarray, "k"]
    ) -> Float64[np.ndarray, "m"]:
        """Return the slack of the distance from the solid obstacles [m].

        The box around each sphere's path rules out most obstacles for all poses at once.
        """
        scene = self.scene
        low, high = np.min(centres, axis=0)[:, None], np.max(centres, axis=0)[:, None]
        outside = np.maximum(np.maximum(low - scene.centres, scene.centres - high), 0.0)
        reach = radii[:, None] + scene.radii + self.keep_out
        bounds = np.linalg.norm(outside, axis=-1) - reach
        near = bounds < EXACT_SLACK
        slack = np.full(len(centres), np.min(bounds, where=~near, initial=np.inf))
        for k in np.flatnonzero(np.any(near, axis=0)):
            spheres = np.flatnonzero(near[:, k])
            gaps = np.linalg.norm(centres[:, spheres] - scene.centres[k], axis=-1)
            gaps -= reach[spheres, k]
            if np.any(gaps < EXACT_SLACK):
                gaps = signed_distance(centres[:, spheres], scene.solids[k])
                gaps -= radii[spheres] + self.keep_out
            slack = np.minimum(slack, np.min(gaps, axis=1))
        return slack

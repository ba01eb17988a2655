"""Collision constraint: bodies keep their distance from obstacles (rules `keep_out`, `table`)."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import signed_distance
from lariat.safety.constraints.near_solids import NearSolids
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.slacks import Slacks
from lariat.safety.constraints.sphere_distance import distances

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
        self,
        centres: Float64[np.ndarray, "m k 3"],
        radii: Float64[np.ndarray, "k"],
        near: NearSolids | None = None,
    ) -> Slacks:
        """Return the slacks of both rules for k spheres at m poses [m].

        A slack of at least `EXACT_SLACK` is a lower bound.

        Args:
            centres: Centres of the spheres in the world frame [m].
            radii: Radii of the spheres [m].
            near: Solids that were near the same spheres before; it is kept up to date.
        """
        if not len(radii):
            free = np.full(len(centres), np.inf)
            return {"keep_out": free, "table": free}
        table = [
            np.min(signed_distance(centres, o) - radii, axis=1) for o in self.scene.half_spaces
        ]
        return {
            "keep_out": self._solid_slack(centres, radii, near or NearSolids(surroundings=0.0)),
            "table": np.min(table, axis=0) if table else np.full(len(centres), np.inf),
        }

    def _solid_slack(
        self,
        centres: Float64[np.ndarray, "m k 3"],
        radii: Float64[np.ndarray, "k"],
        listed: NearSolids,
    ) -> Float64[np.ndarray, "m"]:
        """Return the slack of the distance from the solid obstacles [m].

        The box around each sphere's path rules out most obstacles for all poses at once.
        """
        scene = self.scene
        low, high = np.min(centres, axis=0), np.max(centres, axis=0)
        listed.update(scene, low, high, radii + self.keep_out, EXACT_SLACK)
        points = scene.centres[listed.columns]
        outside = np.maximum(np.maximum(low[:, None] - points, points - high[:, None]), 0.0)
        reach = radii[:, None] + scene.radii[listed.columns] + self.keep_out
        bounds = np.linalg.norm(outside, axis=-1) - reach
        near = bounds < EXACT_SLACK
        least = min(listed.far_slack, float(np.min(bounds, where=~near, initial=np.inf)))
        slack = np.full(len(centres), least)
        nearest = np.flatnonzero(np.any(near, axis=0))
        if not len(nearest):
            return slack
        near, columns = near[:, nearest], listed.columns[nearest]
        gaps = distances(centres, points[nearest]) - reach[:, nearest]
        gaps = np.min(np.where(near, gaps, np.inf), axis=1)
        coarse = np.min(gaps, axis=0) >= EXACT_SLACK
        slack = np.minimum(slack, np.min(gaps[:, coarse], axis=1, initial=np.inf))
        spheres, fine = np.nonzero(near & ~coarse)
        exact = scene.solid_distances(centres[:, spheres], columns[fine])
        exact -= radii[spheres] + self.keep_out
        return np.minimum(slack, np.min(exact, axis=1, initial=np.inf))

"""Check of many shapes of a rope between its grips at once: clearance, workspace, distances."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.grippers import axis_spacing
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import scene_distance
from lariat.geometry.polylines import with_midpoints
from lariat.planning.problem import Problem
from lariat.safety.motion_contract import PATH_SPACING_MARGIN, PATH_WORKSPACE_MARGIN

START_RELAXATION = 1e-3
"""Clearance by which a path may fall short of that of start and goal, near them [m]."""
RELAXATION_SLOPE = 0.5
"""Increase of the required clearance with the rope's distance from start or goal [-]."""


class ShapeCheck:
    """Tells shapes that keep their clearance; start and goal may have less, and what is near."""

    def __init__(
        self,
        problem: Problem,
        clearance: float,
        ends: list[tuple[Float64[np.ndarray, "n 3"], Grips]],
    ) -> None:
        """Create the check.

        Args:
            clearance: Clearance of the rope on the way [m].
        """
        self._problem = problem
        limits = problem.limits
        self._least = np.array(
            [
                clearance,
                max(clearance, limits.keep_out),
                limits.spacing + PATH_SPACING_MARGIN,
                axis_spacing(limits.gripper_radius, limits.keep_out),
            ]
        )
        self._longest = problem.longest_grip_distance + 1e-6
        self._ends = [(nodes, self._distances(nodes[None], grips)) for nodes, grips in ends]

    def clear(self, nodes: Float64[np.ndarray, "k n 3"], grips: Grips) -> Bool[np.ndarray, "k"]:
        """Return whether each shape may be taken.

        Args:
            nodes: Nodes of the rope [m].
        """
        distances, least = self._distances(nodes, grips), self._least[:, None]
        for end, own in self._ends:
            away = np.linalg.norm(nodes - end, axis=2).max(axis=1)
            least = np.minimum(least, own + RELAXATION_SLOPE * away - START_RELAXATION)
        low, high = np.array(self._problem.limits.workspace)
        margin = PATH_WORKSPACE_MARGIN
        inside = (grips.positions >= low + margin) & (grips.positions <= high - margin)
        return (
            np.all(distances >= least, axis=0)
            & (distances[2] <= self._longest)
            & np.all(inside | ~self._problem.moves[:, :3], axis=(1, 2))
        )

    def _distances(
        self, nodes: Float64[np.ndarray, "k n 3"], grips: Grips
    ) -> Float64[np.ndarray, "4 k"]:
        """Clearances of rope and grippers; distances of the grips and of the grippers' axes [m]."""
        problem = self._problem
        rope = scene_distance(with_midpoints(nodes), problem.obstacles).min(axis=1)
        body = scene_distance(problem.gripper_points(grips), problem.solid).min(axis=1)
        apart = np.linalg.norm(grips.positions[:, 1] - grips.positions[:, 0], axis=1)
        axes, _ = problem.gripper_distances(grips)
        return np.array([rope - problem.radius, body - problem.limits.gripper_radius, apart, axes])

"""Check of many shapes of a rope between its grips at once: clearance, workspace, distances."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.grippers import axis_spacing, gripper_axis_distance, swept_gripper_points
from lariat.geometry.obstacles import scene_distance
from lariat.geometry.polylines import with_midpoints
from lariat.planning.problem import Problem
from lariat.planning.tree_search.grip_motion import Grips
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
        self._clearance = clearance
        self._body = max(clearance, problem.limits.keep_out)
        limits = problem.limits
        self._longest = problem.longest_grip_distance + 1e-6
        self._spacing = axis_spacing(limits.gripper_radius, limits.keep_out)
        self._ends: list[tuple[np.ndarray, float, float, float, float]] = []
        for nodes, grips in ends:
            rope, body = self._distances(nodes[None], grips)
            apart, bodies = self._spacings(grips)
            self._ends.append(
                (nodes, float(rope[0]), float(body[0]), float(apart[0]), float(bodies[0]))
            )

    def clear(self, nodes: Float64[np.ndarray, "k n 3"], grips: Grips) -> Bool[np.ndarray, "k"]:
        """Return whether each shape may be taken.

        Args:
            nodes: Nodes of the rope [m].
        """
        limits = self._problem.limits
        rope, body = self._distances(nodes, grips)
        least_rope, least_body = (
            np.full(len(nodes), self._clearance),
            np.full(len(nodes), self._body),
        )
        apart, bodies = self._spacings(grips)
        spacing = np.full(len(nodes), limits.spacing + PATH_SPACING_MARGIN)
        body_spacing = np.full(len(nodes), self._spacing)
        for end, own, own_body, own_apart, own_bodies in self._ends:
            away = np.linalg.norm(nodes - end, axis=2).max(axis=1)
            more = RELAXATION_SLOPE * away - START_RELAXATION
            least_rope = np.minimum(least_rope, own + more)
            least_body = np.minimum(least_body, own_body + more)
            spacing = np.minimum(spacing, own_apart + more)
            body_spacing = np.minimum(body_spacing, own_bodies + more)
        low, high = np.array(limits.workspace)
        margin = PATH_WORKSPACE_MARGIN
        inside = (grips.positions >= low + margin) & (grips.positions <= high - margin)
        return (
            (rope >= least_rope)
            & (body >= least_body)
            & (apart >= spacing)
            & (apart <= self._longest)
            & (bodies >= body_spacing)
            & np.all(inside | ~self._problem.moves[:, :3], axis=(1, 2))
        )

    def _distances(
        self, nodes: Float64[np.ndarray, "k n 3"], grips: Grips
    ) -> tuple[Float64[np.ndarray, "k"], Float64[np.ndarray, "k"]]:
        """Clearances of the rope, and of the grippers [m]."""
        problem = self._problem
        rope = scene_distance(with_midpoints(nodes), problem.obstacles).min(axis=1)
        grippers = problem.grippers(grips.positions, grips.orientations)
        points = swept_gripper_points(*grippers, problem.limits.gripper_reach)
        body = scene_distance(points.reshape(-1, 6, 3), problem.solid).min(axis=1)
        return rope - problem.radius, body - problem.limits.gripper_radius

    def _spacings(self, grips: Grips) -> tuple[Float64[np.ndarray, "k"], Float64[np.ndarray, "k"]]:
        """Distances of the grips, and of the grippers' axes [m]."""
        apart = np.linalg.norm(grips.positions[:, 1] - grips.positions[:, 0], axis=1)
        grippers = self._problem.grippers(grips.positions, grips.orientations)
        bodies, _ = gripper_axis_distance(*grippers, self._problem.limits.gripper_reach)
        return apart, bodies

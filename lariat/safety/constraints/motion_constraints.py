"""Constraints on the grips and grippers of a cell, evaluated together along a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grippers import GripperBody
from lariat.geometry.obstacles import Obstacle
from lariat.safety.constraints.collision import CollisionConstraint
from lariat.safety.constraints.near_solids import NearSolids
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.rope_length import RopeLengthConstraint
from lariat.safety.constraints.rule import Rule
from lariat.safety.constraints.slacks import Slacks, first_broken
from lariat.safety.constraints.spacing import grip_distances
from lariat.safety.constraints.sphere_distance import Spheres
from lariat.safety.constraints.workspace import Corner, region_slack, workspace_slack


@dataclass(frozen=True)
class CellBoundaries:
    """Boundaries of a cell, as its scenario states them."""

    rope_length: float
    """Length of the rope [m]."""
    workspace: tuple[Corner, Corner]
    """Lowest and highest corner of the box for the grips [m]."""
    bodies: tuple[GripperBody, ...]
    """Grippers of all ends, left first."""
    keep_out: float = 0.005
    """Least distance of a body from an obstacle, and of the bodies of both ends [m]."""
    spacing: float = 0.03
    """Least distance between two grips [m]."""
    overstretch: float = 0.99
    """Longest path between the grips as a fraction of the rope's length [-]."""
    regions: tuple[Obstacle, ...] = ()
    """Regions that the grips, which hold the ends of the rope, must not leave."""


class MotionConstraints:
    """Constraints of one cell in its present scene."""

    def __init__(self, boundaries: CellBoundaries, driven: Sequence[int]) -> None:
        """Create the constraints without obstacles.

        Args:
            boundaries: Boundaries of the cell.
            driven: Indices of the ends that move; the others are fixed to the world.
        """
        self.boundaries = boundaries
        self.driven = list(driven)
        self.collision = CollisionConstraint(boundaries.keep_out)
        self.rope_length = RopeLengthConstraint(boundaries.overstretch * boundaries.rope_length)
        self._spheres = [body.spheres for body in boundaries.bodies]
        spheres = [self._spheres[k] for k in self.driven]
        self._ends = np.repeat(self.driven, [len(centres) for centres, _ in spheres])
        self._centres = np.concatenate([np.zeros((0, 3)), *(centres for centres, _ in spheres)])
        self._radii = np.array([r for centres, r in spheres for _ in centres])
        ends = np.cumsum([0, *(len(centres) for centres, _ in spheres)]).tolist()
        self._columns = {
            end: slice(*span) for end, span in zip(self.driven, pairwise(ends), strict=True)
        }
        """Spheres of each driven end."""
        self._near_solids = NearSolids()
        self.centres = np.zeros((0, len(self._radii), 3))
        """Centres of the spheres along the path whose slacks were asked for last [m]."""

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """Obstacles of the present scene."""
        return self.collision.scene.obstacles

    def replace_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace the obstacles of the scene."""
        scene = ObstacleScene(obstacles)
        self.collision.scene = scene
        self.rope_length.replace_scene(scene)

    def slacks(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Slacks:
        """Return the slack of every rule on grips and grippers at m poses of all ends [m]."""
        self.centres = self.gripper_centres(positions, orientations)
        result: Slacks = {
            "workspace": workspace_slack(positions[:, self.driven], self.boundaries.workspace),
            "keep_in": region_slack(positions[:, self.driven], self.boundaries.regions),
            **self.collision.slacks(self.centres, self._radii, self._near_solids),
        }
        if positions.shape[1] == 2:
            distances = grip_distances(positions)
            result["spacing"] = distances - self.boundaries.spacing
            result["overstretch"] = self.rope_length.slack(positions, distances)
        return result

    def broken(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
        margin: float = 0.0,
    ) -> tuple[Rule, float] | None:
        """Return the first rule that a path of all ends breaks, and by how much [m].

        Args:
            positions: Positions of the grips, the present ones first [m].
            orientations: Their orientations, wxyz.
            margin: Slack that is demanded beyond zero [m].
        """
        return first_broken(self.slacks(positions, orientations), margin)

    def gripper_centres(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Float64[np.ndarray, "m k 3"]:
        """Return the centres of the spheres that cover the driven grippers [m]."""
        return positions[:, self._ends] + poses.rotate(orientations[:, self._ends], self._centres)

    def driven_spheres(self, end: int, centres: Float64[np.ndarray, "m k 3"]) -> Spheres:
        """Return the spheres that cover the gripper of a driven end.

        Args:
            end: Index of the end.
            centres: Centres of all driven grippers [m].
        """
        columns = self._columns[end]
        return Spheres(centres[:, columns], self._radii[columns])

    def gripper_spheres(
        self,
        end: int,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
    ) -> Spheres:
        """Return the spheres that cover the gripper of any end at m poses of its grip.

        Args:
            end: Index of the end.
            positions: Positions of its grip [m].
            orientations: Its orientations, wxyz.
        """
        return Spheres.of_gripper(self._spheres[end], positions, orientations)

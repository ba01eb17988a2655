"""Constraints on the grips and grippers of a cell, evaluated together along a path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grippers import GripperBody
from lariat.geometry.obstacles import Obstacle
from shared.constraints.collision import EXACT_SLACK, CollisionConstraint
from shared.constraints.near_solids import NearSolids
from shared.constraints.obstacle_scene import ObstacleScene
from shared.constraints.rope_length import RopeLengthConstraint
from shared.constraints.slacks import Slacks
from shared.constraints.spacing import grip_distances
from shared.constraints.sphere_distance import Spheres
from shared.constraints.sphere_kernels import SphereKernels, finite
from shared.constraints.workspace import Corner, region_slack, workspace_slack


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
        self._near_solids = NearSolids()
        counts = [len(centres) for centres, _ in spheres]
        self._table = np.column_stack(
            [np.repeat(np.arange(len(counts)), counts).astype(np.float64), self._centres]
        )
        """Index of each sphere's grip among the driven ones, and its centre there [m]."""
        self.centres: Float64[np.ndarray, "m k 3"] | None = None
        """Centres of the spheres along the path whose slacks were asked for last [m]; None where
        they are not compiled."""
        self._packed_spheres: tuple[Any, ...] = ()
        """Spheres, their radii and the corners of the workspace, for compiled distances."""

    @property
    def obstacles(self) -> tuple[Obstacle, ...]:
        """Obstacles of the present scene."""
        return self.collision.scene.obstacles

    def replace_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replace the obstacles of the scene."""
        scene = ObstacleScene(obstacles)
        self.collision.scene = scene
        self.rope_length.replace_scene(scene)

    def compile(self) -> None:
        """Use compiled distances from now on, where they exist."""
        kernels = SphereKernels.compiled()
        self.collision.kernels = self.rope_length.kernels = kernels
        if kernels is not None:
            corners = np.array(self.boundaries.workspace, dtype=np.float64)
            arrays = self._table, self._radii, corners
            pack = kernels.gripper_slacks.packed
            self._packed_spheres = tuple(pack(k, rows) for k, rows in enumerate(arrays, start=1))

    def slacks(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Slacks:
        """Return the slack of every rule on grips and grippers at m poses of all ends [m]."""
        if self.collision.kernels is not None:
            result = self._compiled_slacks(self.collision.kernels, positions, orientations)
        else:
            centres = self._sphere_centres(positions, orientations)
            result: Slacks = {
                "workspace": workspace_slack(positions[:, self.driven], self.boundaries.workspace),
                "keep_in": region_slack(positions[:, self.driven], self.boundaries.regions),
                **self.collision.slacks(centres, self._radii, self._near_solids),
            }
        if positions.shape[1] == 2:
            distances = grip_distances(positions)
            result["spacing"] = distances - self.boundaries.spacing
            result["overstretch"] = self.rope_length.slack(positions, distances)
        return result

    def _compiled_slacks(
        self,
        kernels: SphereKernels,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Slacks:
        """Return the slacks of grips and grippers by one call of compiled code [m]."""
        driven = np.concatenate([positions, orientations], axis=2)[:, self.driven]
        found = np.full((len(driven), 3), np.nan)
        self.centres = np.full((len(driven), len(self._radii), 3), np.nan)
        if finite(driven):
            kernels.gripper_slacks(
                driven.reshape(-1, 7),
                *self._packed_spheres,
                self.collision.scene.table,
                self.centres.reshape(-1, 3),
                found,
                len(self.driven),
                self.boundaries.keep_out,
                EXACT_SLACK,
            )
        result: Slacks = {"workspace": found[:, 0]}
        if self.boundaries.regions:
            result["keep_in"] = region_slack(driven[..., :3], self.boundaries.regions)
        result["keep_out"], result["table"] = found[:, 1], found[:, 2]
        return result

    def slacks_of_bodies(
        self,
        bodies: Sequence[Obstacle],
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Slacks:
        """Return the slacks of the rules that some obstacles of the scene can break [m].

        Args:
            bodies: The obstacles, for the rules on grippers; the rope goes round all of the scene.
            positions: Positions of all ends at m poses [m].
            orientations: Their orientations, wxyz.
        """
        collision = CollisionConstraint(self.boundaries.keep_out)
        collision.scene = ObstacleScene(bodies)
        result = collision.slacks(self._sphere_centres(positions, orientations), self._radii)
        if positions.shape[1] == 2:
            distances = grip_distances(positions)
            result["overstretch"] = self.rope_length.slack(positions, distances)
        return result

    def _sphere_centres(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
    ) -> Float64[np.ndarray, "m k 3"]:
        """Return the centres of the spheres that cover the driven grippers."""
        return positions[:, self._ends] + poses.rotate(orientations[:, self._ends], self._centres)

    def gripper_spheres(
        self,
        end: int,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
        centres: Float64[np.ndarray, "m k 3"] | None = None,
    ) -> Spheres:
        """Return the spheres that cover the gripper of one end at m poses.

        Args:
            end: Index of the end.
            positions: Positions of its grip [m].
            orientations: Its orientations, wxyz.
            centres: Centres of all driven grippers at these poses, where they are known [m].
        """
        if centres is not None and end in self.driven:
            first = int(np.searchsorted(self._ends, end))
            size = len(self._spheres[end][0])
            columns = slice(first, first + size)
            return Spheres(centres[:, columns], self._radii[columns])
        return Spheres.of_gripper(self._spheres[end], positions, orientations)

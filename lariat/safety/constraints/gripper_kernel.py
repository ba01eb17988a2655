"""Slacks of grips and grippers by one call of compiled code, in memory that stays."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from lariat.machine_code.call import CompiledKernel, PreparedCall
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.sphere_kernels import finite

LEAST_ROOM = 64
"""Number of poses for which there is memory from the beginning."""


class GripperSlacks(NamedTuple):
    """Slacks at m poses; what follows overwrites them."""

    table: Float64[np.ndarray, "m 5"]
    """Slacks of workspace, solids and half spaces, of the least and of the greatest distance
    between two grips [m]; NaN where a grip is not finite."""
    centres: Float64[np.ndarray, "m k 3"]
    """Centres of the spheres that cover the driven grippers [m]."""
    touched: bool
    """Whether the bounding sphere of a solid is in the way between two grips."""


class GripperKernel:
    """Kernel with the constants of one cell."""

    def __init__(
        self,
        kernel: CompiledKernel,
        driven: list[int],
        spheres: tuple[Float64[np.ndarray, "k 4"], Float64[np.ndarray, "k"]],
        workspace: Float64[np.ndarray, "2 3"],
        numbers: tuple[float, float, float, float],
    ) -> None:
        """Lay out the constants.

        Args:
            kernel: The kernel.
            driven: Indices of the ends that move.
            spheres: End of each sphere that covers a gripper, and its centre there; radii [m].
            workspace: Lowest and highest corner of the box for the driven grips [m].
            numbers: Least distance from a solid, slack from which on a lower bound serves, least
                and greatest distance between two grips [m].
        """
        self._kernel, self._numbers = kernel, numbers
        self._constants = np.array(driven, dtype=np.float64), *spheres, workspace
        self._touched = np.zeros(1)
        self._scene: ObstacleScene | None = None
        self._call: PreparedCall | None = None
        self._grips = np.zeros((0, 0, 7))

    def __call__(
        self,
        positions: Float64[np.ndarray, "m ends 3"],
        orientations: Float64[np.ndarray, "m ends 4"],
        scene: ObstacleScene,
    ) -> GripperSlacks:
        """Return the slacks at m poses of all ends.

        Args:
            positions: Positions of the grips [m].
            orientations: Their orientations, wxyz.
            scene: Obstacles.
        """
        count, ends = positions.shape[:2]
        call = self._prepared(count, ends, scene)
        grips, table = self._grips[:count], self._table[:count]
        grips[..., :3], grips[..., 3:] = positions, orientations
        if finite(grips):
            call(count)
        else:
            # The compiler takes all numbers for finite.
            table[:] = self._centres[:count] = np.nan
            self._touched[0] = 0.0
        return GripperSlacks(table, self._centres[:count], self._touched[0] != 0.0)

    def _prepared(self, count: int, ends: int, scene: ObstacleScene) -> PreparedCall:
        """Return the call for a number of poses in a scene."""
        if self._call is not None and scene is self._scene and count <= len(self._grips):
            return self._call
        if count > len(self._grips):
            room = max(2 * count, LEAST_ROOM)
            self._grips = np.zeros((room, ends, 7))
            self._centres = np.zeros((room, len(self._constants[2]), 3))
            self._table = np.zeros((room, 5))
        self._scene = scene
        self._call = self._kernel.prepared(
            self._grips.reshape(-1, 7),
            *self._constants,
            scene.table,
            self._centres.reshape(-1, 3),
            self._table,
            self._touched,
            ends,
            *self._numbers,
        )
        return self._call

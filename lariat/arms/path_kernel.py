"""Kernel of an arm's path: joints, links and singularity of all its poses in one call."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

from lariat.arms.kernel_self_tests import SCRATCH_SIZE
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.kernel_cache import cache
from lariat.kernel_cache.source import KernelSource


def _source(function: str) -> KernelSource:
    return KernelSource(
        function.replace("_", "-"),
        f"lariat.arms.kernels:{function}",
        ("lariat.arms.kernels",),
        f"lariat.arms.kernel_self_tests:{function}",
        Path(__file__).parents[2],
    )


SOURCES = (_source("follow_path"), _source("joint_speeds"))
"""Kernels of a path of the grip, and of the joint speeds for a twist of it."""
SPEED_CUTOFF = 1e-6
"""Share of the largest singular value below which one counts as zero [-]."""
EXACT_SINGULAR_VALUE = 0.05
"""Singular value from which on a lower bound serves [m/rad], above the least that is permitted."""
LEAST_ROOM = 64
"""Number of poses for which there is memory from the beginning."""
MOST_JOINTS = 6
"""Number of joints that the kernel solves at most: it knows no posture."""


class ArmPath(NamedTuple):
    """Path of an arm; the next one overwrites its spheres and singular values."""

    joints: Float64[np.ndarray, "m j"]
    """Joint angles [rad]."""
    centres: Float64[np.ndarray, "m k 3"]
    """Centres of the spheres that cover the links, in the world [m]."""
    singular_values: Float64[np.ndarray, "m"]
    """Smallest singular values of the Jacobian; from `EXACT_SINGULAR_VALUE` on, lower bounds of
    as much [m/rad]."""


class PathKernel:
    """Kernel with the constants of one arm."""

    def __init__(
        self,
        joints: tuple[np.ndarray, np.ndarray],
        poses_of_frames: Sequence[Pose],
        spheres: tuple[Int64[np.ndarray, "k"], Float64[np.ndarray, "k 3"]],
        newton: tuple[float, float, float, int],
    ) -> None:
        """Lay out the constants.

        Args:
            joints: Placement of each joint in the one before it, and its axis.
            poses_of_frames: Flange in last joint, world in base, flange in grip, base in world.
            spheres: Joint of each sphere that covers a link, and its centre there [m].
            newton: Damping, largest step [rad], tolerance [m, rad] and most steps.
        """
        placements, self._axes = joints
        count = len(self._axes)
        chain = np.zeros((count + len(poses_of_frames), 15))
        chain[:count, :9] = placements[:, :3, :3].reshape(count, 9)
        chain[:count, 9:12], chain[:count, 12:] = placements[:, :3, 3], self._axes
        for row, pose in zip(chain[count:], poses_of_frames, strict=True):
            row[:9], row[9:12] = poses.matrix(pose.orientation).ravel(), pose.position
        self._kernel, speeds = map(cache.kernel, SOURCES)
        self._chain, self._newton = chain, newton
        self._spheres = np.column_stack([*spheres]).astype(np.float64)
        self._scratch = np.zeros(SCRATCH_SIZE)
        self._make_room(LEAST_ROOM)
        self._joints, self._twist, self._rates = np.zeros((1, count)), np.zeros((2, 3)), np.zeros(6)
        arrays = chain, self._joints, self._twist, self._rates, self._scratch
        self._speeds = speeds.prepared(*arrays, SPEED_CUTOFF)

    def follow(
        self,
        positions: Float64[np.ndarray, "m 3"],
        orientations: Float64[np.ndarray, "m 4"],
        near: Float64[np.ndarray, "j"],
    ) -> ArmPath | None:
        """Return the path through poses of the grip, `near` first; None when one is out of reach.

        Args:
            positions: Positions of the grip in the world [m].
            orientations: Its orientations, wxyz.
            near: Joint angles at the beginning [rad].
        """
        count = len(positions)
        if count >= len(self._path):
            self._make_room(2 * count)
        self._grips[:count, :3], self._grips[:count, 3:] = positions, orientations
        path = self._solved(count, near, count + 1)
        if path is None:
            return None
        return ArmPath(path, self._centres[: count + 1], self._values[: count + 1])

    def solve(
        self,
        position: Float64[np.ndarray, "3"],
        orientation: Float64[np.ndarray, "4"],
        near: Float64[np.ndarray, "j"],
    ) -> Float64[np.ndarray, "j"] | None:
        """Return the joints for one pose of the grip; None when it is out of reach."""
        self._grips[0, :3], self._grips[0, 3:] = position, orientation
        path = self._solved(1, near, 0)
        return None if path is None else path[1]

    def joint_speed(
        self, joints: Float64[np.ndarray, "j"], velocity: Float64[np.ndarray, "2 3"]
    ) -> Float64[np.ndarray, "j"]:
        """Return the joint speeds of least norm for a twist of the grip in the world [rad/s]."""
        self._joints[0], self._twist[:] = joints, velocity
        self._speeds()
        return self._rates[: len(joints)].copy()

    def _make_room(self, poses: int) -> None:
        """Make room for a path of so many poses, and the joints before them."""
        self._grips, self._path = np.zeros((poses, 7)), np.zeros((poses + 1, len(self._axes)))
        self._centres = np.zeros((poses + 1, len(self._spheres), 3))
        self._values = np.zeros(poses + 1)
        self._follow = self._kernel.prepared(
            self._chain,
            self._grips,
            self._path,
            self._spheres,
            self._centres.reshape(-1, 3),
            self._values,
            self._scratch,
            *self._newton,
            EXACT_SINGULAR_VALUE,
        )

    def _solved(
        self, count: int, near: Float64[np.ndarray, "j"], rows: int
    ) -> Float64[np.ndarray, "m j"] | None:
        """Return the joints for the first poses, `near` first; None when one is out of reach.

        Args:
            count: Number of poses.
            near: Joint angles at the beginning [rad].
            rows: Number of rows of the path whose links and Jacobian are wanted.
        """
        # The compiler takes all numbers for finite: what is not must not pass as solved.
        if not np.isfinite(self._grips[:count]).all():
            return None
        self._path[0] = near
        self._follow(count, rows)
        path = self._path[: count + 1].copy()
        return path if self._scratch[0] == count and np.isfinite(path).all() else None

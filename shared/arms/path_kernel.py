"""Kernel of an arm's path: joints, links and singularity of all its poses in one call."""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64, Int64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.machine_code import library
from lariat.machine_code.call import CompiledKernel
from lariat.machine_code.kernel_source import KernelSource
from shared.arms.kernel_trials import SCRATCH_SIZE

SOURCE = KernelSource(
    "arm-path",
    "shared.arms.kernels:follow_path",
    ("shared.arms.kernels",),
    "shared.arms.kernel_trials:trials",
    Path(__file__).parents[2],
)
"""The kernel."""
MOST_JOINTS = 6
"""Number of joints that the kernel solves at most: it knows no posture."""


class ArmPath(NamedTuple):
    """Path of an arm."""

    joints: Float64[np.ndarray, "m j"]
    """Joint angles [rad]."""
    centres: Float64[np.ndarray, "m k 3"]
    """Centres of the spheres that cover the links, in the world [m]."""
    singular_values: Float64[np.ndarray, "m"]
    """Smallest singular values of the Jacobian [m/rad]."""


class PathKernel:
    """Kernel with the constants of one arm."""

    def __init__(
        self,
        kernel: CompiledKernel,
        joints: tuple[np.ndarray, np.ndarray],
        poses_of_frames: Sequence[Pose],
        spheres: tuple[Int64[np.ndarray, "k"], Float64[np.ndarray, "k 3"]],
        newton: tuple[float, float, float, int],
    ) -> None:
        """Lay out the constants.

        Args:
            kernel: The kernel.
            joints: Placement of each joint in the one before it, and its axis.
            poses_of_frames: Flange in last joint, world in base, flange in grip, base in world.
            spheres: Joint of each sphere that covers a link, and its centre there [m].
            newton: Damping, largest step [rad], tolerance [m, rad] and most steps.
        """
        placements, axes = joints
        count = len(axes)
        self._chain = np.zeros((count + len(poses_of_frames), 15))
        self._chain[:count, :9] = placements[:, :3, :3].reshape(count, 9)
        self._chain[:count, 9:12], self._chain[:count, 12:] = placements[:, :3, 3], axes
        for row, pose in zip(self._chain[count:], poses_of_frames, strict=True):
            row[:9], row[9:12] = poses.matrix(pose.orientation).ravel(), pose.position
        self._spheres = np.column_stack([*spheres]).astype(np.float64)
        self._scratch = np.zeros(SCRATCH_SIZE)
        self._newton = newton
        self._kernel = kernel
        self._none = np.zeros((0, 3)), np.zeros(0)

    def follow(
        self, grips: Float64[np.ndarray, "m 7"], near: Float64[np.ndarray, "j"]
    ) -> ArmPath | None:
        """Return the path through poses of the grip, `near` first; None when one is out of reach.

        Args:
            grips: Positions [m] and quaternions wxyz in the world.
            near: Joint angles at the beginning [rad].
        """
        path = np.empty((len(grips) + 1, len(near)))
        path[0] = near
        centres = np.empty((len(path), len(self._spheres), 3))
        values = np.empty(len(path))
        self._run(grips, path, centres.reshape(-1, 3), values)
        # The compiler takes all numbers for finite: what is not must not pass as solved.
        if self._scratch[0] < len(grips) or not np.isfinite(path).all():
            return None
        return ArmPath(path, centres, values)

    def solve(
        self, grip: Float64[np.ndarray, "7"], near: Float64[np.ndarray, "j"]
    ) -> Float64[np.ndarray, "j"] | None:
        """Return the joints for one pose of the grip; None when it is out of reach."""
        path = np.empty((2, len(near)))
        path[0] = near
        self._run(grip[None], path, *self._none)
        solved = self._scratch[0] == 1.0 and np.isfinite(path[1]).all()
        return path[1] if solved else None

    def _run(self, grips: np.ndarray, path: np.ndarray, *results: np.ndarray) -> None:
        self._kernel(
            self._chain, grips, path, self._spheres, *results, self._scratch, *self._newton
        )


def compiled() -> CompiledKernel | None:
    """Return the kernel; None where there is no compiler and none has been compiled."""
    return library.compiled_kernel(SOURCE) if find_spec("taichi") else None

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


def _source(function: str) -> KernelSource:
    return KernelSource(
        function.replace("_", "-"),
        f"shared.arms.kernels:{function}",
        ("shared.arms.kernels",),
        f"shared.arms.kernel_trials:{function}",
        Path(__file__).parents[2],
    )


SOURCES = (_source("follow_path"), _source("joint_speeds"))
"""Kernels of a path of the grip, and of the joint speeds for a twist of it."""
SPEED_CUTOFF = 1e-6
"""Share of the largest singular value below which one counts as zero [-]."""
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
        kernels: tuple[CompiledKernel, CompiledKernel],
        joints: tuple[np.ndarray, np.ndarray],
        poses_of_frames: Sequence[Pose],
        spheres: tuple[Int64[np.ndarray, "k"], Float64[np.ndarray, "k 3"]],
        newton: tuple[float, float, float, int],
    ) -> None:
        """Lay out the constants.

        Args:
            kernels: The kernels of `SOURCES`.
            joints: Placement of each joint in the one before it, and its axis.
            poses_of_frames: Flange in last joint, world in base, flange in grip, base in world.
            spheres: Joint of each sphere that covers a link, and its centre there [m].
            newton: Damping, largest step [rad], tolerance [m, rad] and most steps.
        """
        placements, axes = joints
        count = len(axes)
        chain = np.zeros((count + len(poses_of_frames), 15))
        chain[:count, :9] = placements[:, :3, :3].reshape(count, 9)
        chain[:count, 9:12], chain[:count, 12:] = placements[:, :3, 3], axes
        for row, pose in zip(chain[count:], poses_of_frames, strict=True):
            row[:9], row[9:12] = poses.matrix(pose.orientation).ravel(), pose.position
        self._scratch = np.zeros(SCRATCH_SIZE)
        self._follow, self._speeds = kernels
        self._sphere_count = len(spheres[0])
        self._chain, self._spheres = (
            self._follow.packed(0, chain),
            self._follow.packed(3, np.column_stack([*spheres]).astype(np.float64)),
        )
        self._rest = self._follow.packed(6, self._scratch), *newton
        self._none = np.zeros((0, 3)), np.zeros(0)
        self._speeds_chain = self._speeds.packed(0, chain)
        self._speeds_rest = self._speeds.packed(4, self._scratch), SPEED_CUTOFF

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
        centres = np.empty((len(path), self._sphere_count, 3))
        values = np.empty(len(path))
        solved = self._run(grips, path, centres.reshape(-1, 3), values)
        return ArmPath(path, centres, values) if solved else None

    def solve(
        self, grip: Float64[np.ndarray, "7"], near: Float64[np.ndarray, "j"]
    ) -> Float64[np.ndarray, "j"] | None:
        """Return the joints for one pose of the grip; None when it is out of reach."""
        path = np.empty((2, len(near)))
        path[0] = near
        return path[1] if self._run(grip[None], path, *self._none) else None

    def joint_speed(
        self, joints: Float64[np.ndarray, "j"], velocity: Float64[np.ndarray, "2 3"]
    ) -> Float64[np.ndarray, "j"]:
        """Return the joint speeds of least norm for a twist of the grip in the world [rad/s]."""
        speeds, twist = np.empty(len(joints)), np.ascontiguousarray(velocity)
        self._speeds(self._speeds_chain, joints[None], twist, speeds, *self._speeds_rest)
        return speeds

    def _run(self, grips: np.ndarray, path: np.ndarray, *results: np.ndarray) -> bool:
        """Fill path and results, and return whether all poses are within reach."""
        # The compiler takes all numbers for finite: what is not must not pass as solved.
        if not np.isfinite(grips).all():
            return False
        self._follow(self._chain, grips, path, self._spheres, *results, *self._rest)
        return bool(self._scratch[0] == len(grips) and np.isfinite(path).all())


def compiled() -> tuple[CompiledKernel, CompiledKernel] | None:
    """Return the kernels; None where there is no compiler and none has been compiled."""
    if not find_spec("taichi"):
        return None
    follow, speeds = map(library.compiled_kernel, SOURCES)
    return (follow, speeds) if follow and speeds else None

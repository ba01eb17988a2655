"""Compiled motion of the command, in place of calls of NumPy."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.kernel_cache import cache
from lariat.kernel_cache.source import KernelSource
from lariat.safety.constraints.path_densification import (
    GRIPPER_LEVER_ARM,
    LEAST_STOP_POSES,
    MAX_POSE_SPACING,
    MOST_STOP_POSES,
)
from lariat.safety.motion.reference_tracking import NextCommand, ReferenceTracker
from lariat.trajectory import NANOSECONDS, Blend, MotionState, SetpointChunk, Spline, Stop

PACKAGE = "lariat.safety.motion"
LEAST_ROOM = 64
"""Number of points of a curve for which there is memory from the beginning."""


def _source(function: str) -> KernelSource:
    return KernelSource(
        function.replace("_", "-"),
        f"{PACKAGE}.kernels:{function}",
        (f"{PACKAGE}.kernels",),
        f"{PACKAGE}.kernel_self_tests:{function}",
        Path(__file__).parents[3],
    )


REFERENCE, COMMAND = _source("evaluate_reference"), _source("advance_command")
SOURCES = (REFERENCE, COMMAND)
"""All kernels of the motion."""

States = Float64[np.ndarray, "k 19"]
"""State of each grip, columns as in `kernels`."""


@dataclass(frozen=True)
class PackedState(MotionState):
    """State of motion whose numbers lie side by side."""

    rows: States
    """State of each grip."""


class ReferenceKernel:
    """Kernel of the states of curves, in memory that stays."""

    def __init__(self, count: int) -> None:
        """Prepare the kernel. Args: count: Number of grips."""
        self._kernel, self._count = cache.kernel(REFERENCE), count
        self._curve: CompiledSpline | None = None
        """Curve whose points are in the memory."""
        self._make_room(LEAST_ROOM)

    def __call__(
        self, curve: CompiledSpline, now: int, fade: float = 1.0, duration: float = 1.0
    ) -> MotionState:
        """Return the state of a curve, with what is left of a mismatch.

        Args:
            curve: The curve.
            now: Time on its clock [ns].
            fade: Time since the transition began, as a fraction of its duration [-].
            duration: Duration of the transition [s].
        """
        if curve is not self._curve:
            if len(curve.points) > len(self._points):
                self._make_room(2 * len(curve.points))
            self._points[: len(curve.points)] = curve.points
            self._first[:] = curve.first
            self._curve = curve
        self._mismatch[:] = curve.mismatch
        self._call(
            curve.count, curve.dt, (now - curve.start) * NANOSECONDS / curve.dt, fade, duration
        )
        return _state_of(self._rows.copy())

    def _make_room(self, points: int) -> None:
        """Make room for curves of so many points."""
        count = self._count
        self._points = np.zeros((points, count, 2, 3))
        self._first, self._mismatch = np.zeros((count, 4)), np.zeros((count, 18))
        self._rows = np.zeros((count, 19))
        rows = self._points.reshape(-1, 6)
        self._call = self._kernel.prepared(rows, self._first, self._mismatch, self._rows)


class CompiledSpline(Spline):
    """Curve of a chunk."""

    def __init__(self, kernel: ReferenceKernel, chunk: SetpointChunk, start: int) -> None:
        """Build the curve of a chunk of at least two poses.

        Args:
            kernel: The kernel.
            chunk: A chunk whose numbers are finite and whose quaternions have unit norm.
            start: Time of its first pose on the clock of the reader [ns].
        """
        super().__init__(chunk, start)
        self.kernel = kernel
        self.mismatch = np.zeros((len(self.first), 18))
        """Pose, twist and acceleration of each grip as a transition begins, less the curve's."""

    def _state(self, now: int) -> MotionState:
        return self.kernel(self, now)


class CompiledBlend(Blend):
    """Transition to a curve, which serves one of them at a time."""

    spline: CompiledSpline

    def __init__(
        self, spline: CompiledSpline, origin: MotionState, now: int, duration: float
    ) -> None:
        """Begin a transition.

        Args:
            spline: Curve on which the transition ends.
            origin: Motion at the beginning.
            now: Time of the beginning [ns].
            duration: Time in which the offset fades [s].
        """
        super().__init__(spline, origin, now, duration)
        parts = self.displacements, self.twists, self.accelerations
        spline.mismatch = np.concatenate(parts, axis=1).reshape(-1, 18)

    def _state(self, now: int) -> MotionState:
        fade = (now - self.now) * NANOSECONDS / self.duration
        return self.spline.kernel(self.spline, now, fade, self.duration)


class CompiledTracker(ReferenceTracker):
    """Control law whose step is compiled."""

    def __init__(self, tracker: ReferenceTracker, count: int) -> None:
        """Create the control law.

        Args:
            tracker: The same control law.
            count: Number of grips.
        """
        super().__init__(tracker.limits, tracker.settings)
        limits = self.limits
        bounds = [
            limits.speed_bounds,
            limits.acceleration_bounds,
            limits.jerk_bounds,
            self.acceleration,
            self.position_gain,
            self.velocity_gain,
            self.too_fast_bounds,
        ]
        self._states = tuple(np.empty((count, 19)) for _ in range(3))
        self._wanted = np.empty((count, 19))
        self._jerks, self._durations = np.empty((4, count, 2, 3)), np.empty((4, count, 2, 1))
        self._path = np.empty((MOST_STOP_POSES + 1, count, 7))
        self._results = np.zeros(2)
        self._call = cache.kernel(COMMAND).prepared(
            np.hstack(bounds),
            *self._states,
            self._wanted,
            self._jerks.reshape(-1, 3),
            self._durations.reshape(-1, 1),
            self._path.reshape(-1, 7),
            self._results,
        )

    def advance(
        self, state: MotionState, now: MotionState, then: MotionState, h: float
    ) -> NextCommand:
        for rows, motion in zip(self._states, (state, now, then), strict=True):
            _write(rows, motion)
        self._call(h, MAX_POSE_SPACING, GRIPPER_LEVER_ARM, LEAST_STOP_POSES)
        after = _state_of(self._wanted.copy())
        stop = Stop(after.twists, after.accelerations, self._jerks.copy(), self._durations.copy())
        poses, too_fast = self._results.tolist()
        return NextCommand(after, stop, self._path[: int(poses) + 1], too_fast != 0.0)


def _write(rows: States, state: MotionState) -> None:
    if isinstance(state, PackedState):
        rows[:] = state.rows
        return
    rows[:, :3], rows[:, 3:7] = state.positions, state.orientations
    rows[:, 7:13] = state.twists.reshape(-1, 6)
    rows[:, 13:] = state.accelerations.reshape(-1, 6)


def _state_of(rows: States) -> PackedState:
    return PackedState(
        rows[:, :3],
        rows[:, 3:7],
        rows[:, 7:13].reshape(-1, 2, 3),
        rows[:, 13:].reshape(-1, 2, 3),
        rows,
    )

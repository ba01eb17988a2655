"""Compiled motion of the command, in place of calls of NumPy where it exists."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.machine_code import library
from lariat.machine_code.call import CompiledKernel
from lariat.machine_code.kernel_source import KernelSource
from lariat.trajectory import NANOSECONDS, Blend, MotionState, SetpointChunk, Spline, Stop
from services.robot_gateway.motion.reference_tracking import NextCommand, ReferenceTracker
from shared.constraints.path_densification import (
    GRIPPER_LEVER_ARM,
    LEAST_STOP_POSES,
    MAX_POSE_SPACING,
    MOST_STOP_POSES,
)

PACKAGE = "services.robot_gateway.motion"


def _source(function: str) -> KernelSource:
    return KernelSource(
        function.replace("_", "-"),
        f"{PACKAGE}.kernels:{function}",
        (f"{PACKAGE}.kernels",),
        f"{PACKAGE}.kernel_trials:{function}",
        Path(__file__).parents[3],
    )


REFERENCE, COMMAND = _source("evaluate_reference"), _source("advance_command")
SOURCES = (REFERENCE, COMMAND)
"""All kernels of the motion."""

States = Float64[np.ndarray, "k 19"]
"""State of each grip, columns as in `kernels`."""


def compiled() -> tuple[CompiledKernel, CompiledKernel] | None:
    """Return the kernels; None where there is no compiler and none has been compiled."""
    if not find_spec("taichi"):
        return None
    reference, command = (library.compiled_kernel(source) for source in SOURCES)
    return (reference, command) if reference and command else None


@dataclass(frozen=True)
class PackedState(MotionState):
    """State of motion whose numbers lie side by side."""

    rows: States
    """State of each grip."""


class CompiledSpline(Spline):
    """Curve of a chunk."""

    def __init__(self, kernel: CompiledKernel, chunk: SetpointChunk, start: int) -> None:
        """Build the curve of a chunk of at least two poses.

        Args:
            kernel: The kernel.
            chunk: A chunk whose numbers are finite and whose quaternions have unit norm.
            start: Time of its first pose on the clock of the reader [ns].
        """
        super().__init__(chunk, start)
        count = len(self.first)
        points, first = self.points.reshape(-1, 6), np.ascontiguousarray(self.first)
        self.mismatch = np.zeros((count, 18))
        """Pose, twist and acceleration of each grip as a transition begins, less the curve's."""
        self._rows = np.empty((count, 19))
        arrays = points, first, self.mismatch, self._rows
        self._call = kernel.prepared(*arrays, self.count, self.dt)

    def _state(self, now: int) -> MotionState:
        return self.blended(now, 1.0, 1.0)

    def blended(self, now: int, fade: float, duration: float) -> MotionState:
        """Return the state with what is left of the mismatch.

        Args:
            now: Time on the clock of the reader [ns].
            fade: Time since the transition began, as a fraction of its duration [-].
            duration: Duration of the transition [s].
        """
        self._call((now - self.start) * NANOSECONDS / self.dt, fade, duration)
        return _state_of(self._rows.copy())


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
        spline.mismatch[:] = np.concatenate(parts, axis=1).reshape(-1, 18)

    def _state(self, now: int) -> MotionState:
        fade = (now - self.now) * NANOSECONDS / self.duration
        return self.spline.blended(now, fade, self.duration)


class CompiledTracker(ReferenceTracker):
    """Control law whose step is compiled."""

    def __init__(self, kernel: CompiledKernel, tracker: ReferenceTracker, count: int) -> None:
        """Create the control law.

        Args:
            kernel: The kernel.
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
        self._call = kernel.prepared(
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
        for rows, given in zip(self._states, (state, now, then), strict=True):
            _write(rows, given)
        self._call(h, MAX_POSE_SPACING, GRIPPER_LEVER_ARM, LEAST_STOP_POSES)
        after = _state_of(self._wanted.copy())
        stop = Stop(
            after.twists, after.accelerations, self._jerks.copy(), self._durations.copy()
        )
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

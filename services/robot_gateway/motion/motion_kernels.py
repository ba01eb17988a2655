"""Compiled motion of the command, in place of calls of NumPy where it exists."""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.machine_code import library
from lariat.machine_code.call import CompiledKernel
from lariat.machine_code.kernel_source import KernelSource
from lariat.trajectory import NANOSECONDS, Blend, MotionState, Spline, Stop
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


class CompiledBlend(Blend):
    """Transition to a spline."""

    def __init__(
        self,
        kernel: CompiledKernel,
        spline: Spline,
        origin: MotionState,
        now: int,
        duration: float,
    ) -> None:
        """Begin a transition.

        Args:
            kernel: The kernel.
            spline: Curve on which the transition ends.
            origin: Motion at the beginning.
            now: Time of the beginning [ns].
            duration: Time in which the offset fades [s].
        """
        super().__init__(spline, origin, now, duration)
        count = len(spline.first)
        self._kernel = kernel
        mismatch = np.concatenate([self.displacements, self.twists, self.accelerations], axis=1)
        arrays = spline.points.reshape(-1, 6), spline.first, mismatch.reshape(count, 18)
        self._curve = tuple(
            kernel.packed(k, np.ascontiguousarray(rows)) for k, rows in enumerate(arrays)
        )

    def _state(self, now: int) -> MotionState:
        spline = self.spline
        rows = np.empty((len(spline.first), 19))
        self._kernel(
            *self._curve,
            rows,
            spline.count,
            spline.dt,
            (now - spline.start) * NANOSECONDS / spline.dt,
            (now - self.now) * NANOSECONDS / self.duration,
            self.duration,
        )
        return _state_of(rows)


class CompiledTracker(ReferenceTracker):
    """Control law whose step is compiled."""

    def __init__(self, kernel: CompiledKernel, tracker: ReferenceTracker) -> None:
        """Create the control law.

        Args:
            kernel: The kernel.
            tracker: The same control law.
        """
        super().__init__(tracker.limits, tracker.settings)
        limits = self.limits
        self._kernel = kernel
        bounds = [
            limits.speed_bounds,
            limits.acceleration_bounds,
            limits.jerk_bounds,
            self.acceleration,
            self.position_gain,
            self.velocity_gain,
            self.too_fast_bounds,
        ]
        self._results = np.zeros(2)
        self._packed_limits = kernel.packed(0, np.hstack(bounds))
        self._packed_results = kernel.packed(8, self._results)

    def advance(
        self, state: MotionState, now: MotionState, then: MotionState, h: float
    ) -> NextCommand:
        count = len(state.positions)
        wanted, path = np.empty((count, 19)), np.empty(((MOST_STOP_POSES + 1) * count, 7))
        jerks, durations = np.empty((8 * count, 3)), np.empty((8 * count, 1))
        self._kernel(
            self._packed_limits,
            _rows_of(state),
            _rows_of(now),
            _rows_of(then),
            wanted,
            jerks,
            durations,
            path,
            self._packed_results,
            h,
            MAX_POSE_SPACING,
            GRIPPER_LEVER_ARM,
            LEAST_STOP_POSES,
        )
        after = _state_of(wanted)
        stop = Stop(
            after.twists,
            after.accelerations,
            jerks.reshape(4, count, 2, 3),
            durations.reshape(4, count, 2, 1),
        )
        poses, too_fast = self._results.tolist()
        rows = path.reshape(-1, count, 7)[: int(poses) + 1]
        return NextCommand(after, stop, rows, too_fast != 0.0)


def _rows_of(state: MotionState) -> States:
    rows = np.empty((len(state.positions), 19))
    rows[:, :3], rows[:, 3:7] = state.positions, state.orientations
    rows[:, 7:13] = state.twists.reshape(-1, 6)
    rows[:, 13:] = state.accelerations.reshape(-1, 6)
    return rows


def _state_of(rows: States) -> MotionState:
    return MotionState(
        rows[:, :3],
        rows[:, 3:7],
        rows[:, 7:13].reshape(-1, 2, 3),
        rows[:, 13:].reshape(-1, 2, 3),
    )

"""The commanded motion of the driven grippers: it follows a reference and never breaks a limit.

The law is nested: the error in position asks for a velocity, the error in velocity for an
acceleration, and the acceleration changes as fast as the jerk allows. Both askings are linear near
zero and grow with the square root of the error further out, so that half of the limit remains in
hand and nothing overshoots. Feed-forward comes from the reference, so a smooth one is followed
without lag.

At every tick the motion knows a stop that has been checked as a whole. A step is only taken when
the stop after it has been checked too; otherwise the known stop goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.trajectory import MotionLimits, MotionState, Stop, clipped, peak_twists
from lariat.trajectory.limits import norms

SHED_TIME = 0.05
"""Longest time to take away the acceleration of following [s]: what lies between the watchdog's
100 ms and the 150 ms within which braking must have begun."""


@dataclass(frozen=True)
class Braking:
    """A checked stop being carried out, or kept ready."""

    stop: Stop
    elapsed: float = 0.0
    """Since it began [s]."""

    def step(self, state: MotionState, h: float) -> tuple[MotionState, Braking]:
        """The state a time `h` [s] later."""
        before, _, _ = self.stop.at(self.elapsed)
        after, velocity, acceleration = self.stop.at(self.elapsed + h)
        state = state.moved(after - before, velocity, acceleration)
        return state, replace(self, elapsed=self.elapsed + h)


class Follower:
    """Steps the commanded motion of n grippers."""

    def __init__(self, limits: MotionLimits) -> None:
        self.limits = limits
        self.acceleration = np.minimum(limits.acceleration_bounds, SHED_TIME * limits.jerk_bounds)
        """What following uses of the limit on acceleration."""
        bandwidth = limits.jerk_bounds / limits.acceleration_bounds
        self.position_gain = np.minimum(10.0, 0.5 * bandwidth)
        self.velocity_gain = np.minimum(40.0, 2.0 * bandwidth)

    def step(
        self, state: MotionState, now: MotionState, then: MotionState, h: float
    ) -> MotionState:
        """The state a time `h` [s] later, within the limits.

        Args:
            now: The reference at the present time.
            then: The reference at the end of the step.
        """
        limits = self.limits
        back = poses.conjugate(state.orientations)
        error = np.stack(
            [
                now.positions - state.positions,
                poses.logarithm(poses.multiply(now.orientations, back)),
            ],
            axis=1,
        )
        wanted_velocity = clipped(
            now.twists + _eased(error, self.position_gain, limits.acceleration_bounds / 2.0),
            limits.speed_bounds,
        )
        wanted = clipped(
            then.accelerations
            + _eased(wanted_velocity - state.twists, self.velocity_gain, limits.jerk_bounds),
            self.acceleration,
        )
        old = state.accelerations
        new = old + clipped(wanted - old, limits.jerk_bounds * h)
        return state.moved(
            state.twists * h + (old / 3.0 + new / 6.0) * h * h,
            state.twists + (old + new) * (h / 2.0),
            new,
        )

    def too_fast(self, state: MotionState) -> bool:
        """Whether the speed is above the limit, or will be before a stop takes effect."""
        peak = peak_twists(state.twists, state.accelerations, self.limits)
        allowed = self.limits.speed_bounds * (1.0 + 1e-9)
        return bool(np.any(norms(peak) > allowed) or np.any(norms(state.twists) > allowed))

    def stop(self, state: MotionState) -> Stop:
        """The stop from a state."""
        return Stop.plan(state.twists, state.accelerations, self.limits)


def _eased(
    error: Float64[np.ndarray, "n 2 3"],
    gain: Float64[np.ndarray, "n 2 1"],
    rate: Float64[np.ndarray, "n 2 1"],
) -> Float64[np.ndarray, "n 2 3"]:
    """min(gain |e|, sqrt(rate |e|)) along e: its decay never needs more than rate / 2."""
    size = np.maximum(norms(error), 1e-300)
    return error * np.minimum(gain, np.sqrt(rate / size))

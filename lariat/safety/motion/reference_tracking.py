"""Tracking of a reference by the commanded motion, which never exceeds its limits.

The control law is nested: the error in position demands a velocity, the error in velocity an
acceleration, and the acceleration changes as fast as the jerk allows. Both demands are linear near
zero and grow with the square root of the error further out, so that half of the limit stays in
reserve and nothing overshoots. The reference supplies feed-forward, so a smooth one is followed
without lag.

At every tick the motion knows a stop that has been checked as a whole. A step is only taken when
the stop after it has been checked too; otherwise the known stop goes on.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.safety.constraints.path_densification import stop_times
from lariat.trajectory import MotionLimits, MotionState, Stop, clipped, peak_twists
from lariat.trajectory.limits import Bounds, norms
from lariat.trajectory.state import Vectors


@dataclass(frozen=True)
class TrackingSettings:
    """Gains of the control law."""

    shed_time: float = 0.05
    """Longest time in which a stop removes the acceleration of tracking [s]: the time between the
    hold of the watchdog at 100 ms and the 150 ms within which braking must have begun."""
    position_gain: float = 10.0
    """Greatest velocity per error in position [1/s]."""
    velocity_gain: float = 40.0
    """Greatest acceleration per error in velocity [1/s]."""
    speed_tolerance: float = 1e-9
    """Fraction by which rounding may exceed the limit on speed [-]."""


@dataclass(frozen=True)
class Braking:
    """Checked stop that is carried out or kept ready."""

    stop: Stop
    elapsed: float = 0.0
    """Time since the stop began [s]."""

    def step(self, state: MotionState, h: float) -> tuple[MotionState, Braking]:
        """Return state and stop a time `h` [s] later."""
        before, _, _ = self.stop.at(self.elapsed)
        after, twists, accelerations = self.stop.at(self.elapsed + h)
        state = state.moved(after - before, twists, accelerations)
        return state, replace(self, elapsed=self.elapsed + h)


class NextCommand(NamedTuple):
    """Command after a step, not yet checked."""

    state: MotionState
    """The command."""
    stop: Stop
    """Stop that would follow it."""
    path: Float64[np.ndarray, "m k 7"]
    """Positions and orientations of the grips at which it is checked: the present ones, then those
    along the stop."""
    too_fast: bool
    """Whether the speed exceeds its limit, or will before the stop takes effect."""


class ReferenceTracker:
    """Control law by which the commanded motion of k grippers tracks a reference."""

    def __init__(self, limits: MotionLimits, settings: TrackingSettings | None = None) -> None:
        """Create the control law.

        Args:
            limits: Limits on the commanded motion of each gripper.
            settings: Gains.
        """
        self.limits = limits
        self.settings = settings or TrackingSettings()
        acceleration, jerk = limits.acceleration_bounds, limits.jerk_bounds
        self.acceleration: Bounds = np.minimum(acceleration, self.settings.shed_time * jerk)
        """Part of the limit on acceleration that tracking uses [m/s^2, rad/s^2]."""
        bandwidth = jerk / acceleration
        self.position_gain: Bounds = np.minimum(self.settings.position_gain, 0.5 * bandwidth)
        self.velocity_gain: Bounds = np.minimum(self.settings.velocity_gain, 2.0 * bandwidth)

    def step(
        self, state: MotionState, now: MotionState, then: MotionState, h: float
    ) -> MotionState:
        """Return the state a time `h` [s] later, within the limits.

        Args:
            state: Present command.
            now: Reference at the present time.
            then: Reference at the end of the step.
            h: Duration of the step [s].
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
        twists = clipped(
            now.twists + _eased(error, self.position_gain, limits.acceleration_bounds / 2.0),
            limits.speed_bounds,
        )
        target = clipped(
            then.accelerations
            + _eased(twists - state.twists, self.velocity_gain, limits.jerk_bounds),
            self.acceleration,
        )
        old = state.accelerations
        new = old + clipped(target - old, limits.jerk_bounds * h)
        return state.moved(
            state.twists * h + (old / 3.0 + new / 6.0) * h * h,
            state.twists + (old + new) * (h / 2.0),
            new,
        )

    def advance(
        self, state: MotionState, now: MotionState, then: MotionState, h: float
    ) -> NextCommand:
        """Return the command a time `h` [s] later with the stop after it.

        Args:
            state: Present command.
            now: Reference at the present time.
            then: Reference at the end of the step.
            h: Duration of the step [s].
        """
        command = self.step(state, now, then, h)
        stop = self.stop(command)
        moved = stop.at(stop_times(stop))[0]
        turned = poses.multiply(poses.exponential(moved[:, :, 1]), command.orientations[None])
        positions = np.concatenate([state.positions[None], command.positions + moved[:, :, 0]])
        orientations = np.concatenate([state.orientations[None], turned])
        path = np.concatenate([positions, orientations], axis=-1)
        return NextCommand(command, stop, path, self.too_fast(command))

    @property
    def too_fast_bounds(self) -> Bounds:
        """Speeds above which a command is too fast [m/s, rad/s]."""
        return self.limits.speed_bounds * (1.0 + self.settings.speed_tolerance)

    def too_fast(self, state: MotionState) -> bool:
        """Return whether the speed exceeds its limit, or will before a stop takes effect."""
        peak = peak_twists(state.twists, state.accelerations, self.limits)
        allowed = self.too_fast_bounds
        return bool(np.any(norms(peak) > allowed) or np.any(norms(state.twists) > allowed))

    def stop(self, state: MotionState) -> Stop:
        """Return the stop from a state."""
        return Stop.plan(state.twists, state.accelerations, self.limits)


def _eased(error: Vectors, gain: Bounds, rate: Float64[np.ndarray, "2 1"]) -> Vectors:
    """Return min(gain |e|, sqrt(rate |e|)) along e, whose decay never needs more than rate / 2."""
    size = np.maximum(norms(error), 1e-300)
    return error * np.minimum(gain, np.sqrt(rate / size))

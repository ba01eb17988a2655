"""Jerk-limited stop of grippers, straight and in closed form.

From velocity v and acceleration a, the acceleration is first removed along its own direction, which
takes |a| / J. The remaining speed is then removed along its own line with the trapezoidal
deceleration that the limits A and J allow, which takes at most v / A + A / J.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.trajectory.limits import MotionLimits, norms
from lariat.trajectory.sequence import MotionSequence
from lariat.trajectory.state import MotionState, Vectors

MIN_NORM = 1e-12
"""Norm below which a velocity or an acceleration has no direction [SI]."""
REST_TOLERANCE = 1e-12
"""Rounding error of the summed durations of a stop's phases [s]."""
GRID_TOLERANCE = 1e-9
"""Fraction of a grid step by which a stop may outlast its last time [-]."""


def peak_twists(twists: Vectors, accelerations: Vectors, limits: MotionLimits) -> Vectors:
    """Return the twists at the time at which a stop has removed the accelerations [m/s, rad/s].

    Until then the velocity moves on a straight line, so the speed during a stop never exceeds the
    larger one of the present speed and this peak.
    """
    ease = norms(accelerations) / limits.jerk_bounds
    return twists + accelerations * ease / 2.0


@dataclass(frozen=True)
class Stop:
    """Stop of all grippers, each as fast as the limits allow."""

    twists: Vectors
    """Twists at the beginning [m/s, rad/s]."""
    accelerations: Vectors
    """Accelerations at the beginning [m/s^2, rad/s^2]."""
    jerks: Float64[np.ndarray, "4 k 2 3"]
    """Constant jerk in each of the four phases [m/s^3, rad/s^3]."""
    durations: Float64[np.ndarray, "4 k 2 1"]
    """Duration of each phase [s]."""

    @classmethod
    def plan(cls, twists: Vectors, accelerations: Vectors, limits: MotionLimits) -> Stop:
        """Return the stop that begins with given twists and accelerations."""
        jerk, deceleration = limits.jerk_bounds, limits.acceleration_bounds
        size = norms(accelerations)
        peak = peak_twists(twists, accelerations, limits)
        speed = norms(peak)
        ramp = np.minimum(deceleration / jerk, np.sqrt(speed / jerk))
        hold = np.maximum(speed / np.maximum(jerk * ramp, MIN_NORM) - ramp, 0.0)
        backwards = -peak / np.maximum(speed, MIN_NORM) * jerk
        ease = -accelerations / np.maximum(size, MIN_NORM) * jerk
        return cls(
            twists,
            accelerations,
            np.stack([ease, backwards, np.zeros_like(backwards), -backwards]),
            np.stack([size / jerk, ramp, hold, ramp]),
        )

    @property
    def duration(self) -> float:
        """Time until the last gripper rests [s]."""
        return float(np.max(np.sum(self.durations, axis=0), initial=0.0))

    def at(self, t: float | Float64[np.ndarray, "m 1 1 1"]) -> tuple[Vectors, Vectors, Vectors]:
        """Return displacements, twists and accelerations after a time since the beginning.

        Args:
            t: One time or m of them [s]; with m times the results have m rows.

        Returns:
            Displacements [m, rad], twists [m/s, rad/s] and accelerations [m/s^2, rad/s^2].
        """
        left = np.asarray(t, dtype=float)
        displacements = np.zeros(np.broadcast_shapes(left.shape, self.twists.shape))
        twists, accelerations = self.twists, self.accelerations
        for jerk, duration in zip(self.jerks, self.durations, strict=True):
            if not duration.any():
                continue
            tau = np.minimum(np.maximum(left, 0.0), duration)
            left = left - duration
            displacements = displacements + tau * (
                twists + tau * (accelerations / 2.0 + tau * jerk / 6.0)
            )
            twists = twists + tau * (accelerations + tau * jerk / 2.0)
            accelerations = accelerations + tau * jerk
        # The phases add up to rest except for rounding; rest is exact.
        over = left >= -REST_TOLERANCE
        return displacements, np.where(over, 0.0, twists), np.where(over, 0.0, accelerations)


def stopping_states(state: MotionState, limits: MotionLimits, dt: float) -> MotionSequence:
    """Return the states of a stop on a time grid, the last one exactly at rest.

    Args:
        state: State from which the stop begins; it is not among the returned ones.
        dt: Time between the states [s].
    """
    stop = Stop.plan(state.twists, state.accelerations, limits)
    count = int(np.ceil(stop.duration / dt - GRID_TOLERANCE))
    if count == 0:
        return MotionSequence.constant(state, 0)
    times = dt * np.arange(1, count + 1)
    displacements, twists, accelerations = stop.at(times[:, None, None, None])
    twists[-1] = accelerations[-1] = 0.0
    orientations = poses.turned(displacements[:, :, 1], state.orientations)
    positions = state.positions + displacements[:, :, 0]
    return MotionSequence(positions, orientations, twists, accelerations)

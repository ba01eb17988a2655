"""Smooth transition from any motion to a spline."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.trajectory.chunk import NANOSECONDS
from lariat.trajectory.spline import Spline
from lariat.trajectory.state import MotionState, Vectors


class Blend:
    """Spline plus a fading offset, without a step in position, velocity or acceleration.

    The offset is the quintic that leads from the mismatch in position, velocity and acceleration
    to zero.
    """

    def __init__(self, spline: Spline, origin: MotionState, now: int, duration: float) -> None:
        """Begin a transition.

        Args:
            spline: Curve on which the transition ends.
            origin: Motion at the beginning.
            now: Time of the beginning [ns].
            duration: Time in which the offset fades [s].
        """
        self.spline, self.now, self.duration = spline, now, duration
        self._recent_states: dict[int, MotionState] = {}
        target = spline(now)
        back = poses.conjugate(target.orientations)
        self.displacements: Vectors = np.empty(origin.twists.shape)
        self.displacements[:, 0] = origin.positions - target.positions
        self.displacements[:, 1] = poses.logarithm(poses.multiply(origin.orientations, back))
        """Initial mismatch in position and orientation [m, rad]."""
        self.twists = origin.twists - target.twists
        """Initial mismatch in velocity [m/s, rad/s]."""
        self.accelerations = origin.accelerations - target.accelerations
        """Initial mismatch in acceleration [m/s^2, rad/s^2]."""

    @property
    def end(self) -> int:
        """Time at which both spline and fading are over [ns]."""
        return max(self.spline.end, self.now + round(self.duration / NANOSECONDS))

    def __call__(self, now: int) -> MotionState:
        """Return the state at a time that is not before the beginning.

        Args:
            now: Time on the clock of the spline [ns].
        """
        # A control period evaluates its beginning once and its end twice: keep the last two states.
        if now not in self._recent_states:
            if len(self._recent_states) == 2:
                del self._recent_states[min(self._recent_states)]
            self._recent_states[now] = self._state(now)
        return self._recent_states[now]

    def _state(self, now: int) -> MotionState:
        target = self.spline(now)
        T = self.duration
        s = (now - self.now) * NANOSECONDS / T
        if s >= 1.0:
            return target
        x = self._offset(
            1 - s**3 * (10 - s * (15 - 6 * s)),
            s - s**3 * (6 - s * (8 - 3 * s)),
            s * s / 2 - s**3 * (1.5 - s * (1.5 - s / 2)),
        )
        v = self._offset(
            -30 * s * s * (1 - s) ** 2,
            1 - s * s * (18 - s * (32 - 15 * s)),
            s - s * s * (4.5 - s * (6 - 2.5 * s)),
        )
        a = self._offset(
            -60 * s * (1 - s) * (1 - 2 * s),
            -s * (36 - s * (96 - 60 * s)),
            1 - s * (9 - s * (18 - 10 * s)),
        )
        return MotionState(
            target.positions + x[:, 0],
            poses.multiply(poses.exponential(x[:, 1]), target.orientations),
            target.twists + v / T,
            target.accelerations + a / T**2,
        )

    def _offset(self, position: float, velocity: float, acceleration: float) -> Vectors:
        """Return the mismatches weighted with the quintic's basis functions or derivatives."""
        T = self.duration
        return (
            position * self.displacements
            + velocity * T * self.twists
            + acceleration * T**2 * self.accelerations
        )

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
from lariat.trajectory.chunk import Sample
from lariat.trajectory.limits import LimitTable
from lariat.trajectory.stop import Stop, peak_velocity

SHED_TIME = 0.05
"""Longest time to take away the acceleration of following [s]: what lies between the watchdog's
100 ms and the 150 ms within which braking must have begun."""


@dataclass(frozen=True)
class Kinematics:
    """Poses, velocities and accelerations of n grippers at one time."""

    position: Float64[np.ndarray, "n 3"]
    """[m]"""
    orientation: Float64[np.ndarray, "n 4"]
    """wxyz"""
    velocity: Float64[np.ndarray, "n 2 3"]
    """Linear and angular [m/s, rad/s]."""
    acceleration: Float64[np.ndarray, "n 2 3"]
    """[m/s^2, rad/s^2]"""

    @classmethod
    def at_rest(
        cls, position: Float64[np.ndarray, "n 3"], orientation: Float64[np.ndarray, "n 4"]
    ) -> Kinematics:
        """Standing still."""
        still = np.zeros((len(position), 2, 3))
        return cls(np.array(position, float), np.array(orientation, float), still, still)

    @property
    def resting(self) -> bool:
        """Whether nothing moves at all."""
        return not (self.velocity.any() or self.acceleration.any())

    @property
    def sample(self) -> Sample:
        """The same as a reference."""
        return Sample(self.position, self.orientation, self.velocity, self.acceleration)

    def moved(
        self,
        displacement: Float64[np.ndarray, "n 2 3"],
        velocity: Float64[np.ndarray, "n 2 3"],
        acceleration: Float64[np.ndarray, "n 2 3"],
    ) -> Kinematics:
        """After a displacement of translation [m] and rotation [rad]."""
        turned = poses.multiply(poses.exponential(displacement[:, 1]), self.orientation)
        return Kinematics(
            self.position + displacement[:, 0], poses.normalized(turned), velocity, acceleration
        )


@dataclass(frozen=True)
class Braking:
    """A checked stop being carried out, or kept ready."""

    stop: Stop
    elapsed: float = 0.0
    """Since it began [s]."""

    def step(self, state: Kinematics, h: float) -> tuple[Kinematics, Braking]:
        """The state a time `h` [s] later."""
        before, _, _ = self.stop.at(self.elapsed)
        after, velocity, acceleration = self.stop.at(self.elapsed + h)
        state = state.moved(after - before, velocity, acceleration)
        return state, replace(self, elapsed=self.elapsed + h)


class Follower:
    """Steps the commanded motion of n grippers."""

    def __init__(self, limits: LimitTable) -> None:
        self.limits = limits
        self.acceleration = np.minimum(limits.acceleration, SHED_TIME * limits.jerk)
        """What following uses of the limit on acceleration."""
        bandwidth = limits.jerk / limits.acceleration
        self.position_gain = np.minimum(10.0, 0.5 * bandwidth)
        self.velocity_gain = np.minimum(40.0, 2.0 * bandwidth)

    def step(self, state: Kinematics, now: Sample, then: Sample, h: float) -> Kinematics:
        """The state a time `h` [s] later, within the limits.

        Args:
            now: The reference at the present time.
            then: The reference at the end of the step.
        """
        limits = self.limits
        back = poses.conjugate(state.orientation)
        error = np.stack(
            [
                now.position - state.position,
                poses.logarithm(poses.multiply(now.orientation, back)),
            ],
            axis=1,
        )
        wanted_velocity = _clipped(
            now.velocity + _eased(error, self.position_gain, limits.acceleration / 2.0),
            limits.speed,
        )
        wanted = _clipped(
            then.acceleration
            + _eased(wanted_velocity - state.velocity, self.velocity_gain, limits.jerk),
            self.acceleration,
        )
        old = state.acceleration
        new = old + _clipped(wanted - old, limits.jerk * h)
        return state.moved(
            state.velocity * h + (old / 3.0 + new / 6.0) * h * h,
            state.velocity + (old + new) * (h / 2.0),
            new,
        )

    def too_fast(self, state: Kinematics) -> bool:
        """Whether the speed is above the limit, or will be before a stop takes effect."""
        peak = peak_velocity(state.velocity, state.acceleration, self.limits)
        allowed = self.limits.speed * (1.0 + 1e-9)
        return bool(np.any(_norm(peak) > allowed) or np.any(_norm(state.velocity) > allowed))

    def stop(self, state: Kinematics) -> Stop:
        """The stop from a state."""
        return Stop.plan(state.velocity, state.acceleration, self.limits)


def _norm(vectors: Float64[np.ndarray, "n 2 3"]) -> Float64[np.ndarray, "n 2 1"]:
    return np.sqrt(np.einsum("nij,nij->ni", vectors, vectors))[..., None]


def _clipped(
    vectors: Float64[np.ndarray, "n 2 3"], bound: Float64[np.ndarray, "n 2 1"]
) -> Float64[np.ndarray, "n 2 3"]:
    return vectors * np.minimum(1.0, bound / np.maximum(_norm(vectors), 1e-300))


def _eased(
    error: Float64[np.ndarray, "n 2 3"],
    gain: Float64[np.ndarray, "n 2 1"],
    rate: Float64[np.ndarray, "n 2 1"],
) -> Float64[np.ndarray, "n 2 3"]:
    """min(gain |e|, sqrt(rate |e|)) along e: its decay never needs more than rate / 2."""
    size = np.maximum(_norm(error), 1e-300)
    return error * np.minimum(gain, np.sqrt(rate / size))

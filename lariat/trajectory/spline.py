"""Setpoint chunk as a smooth curve.

The poses of a chunk are the control points of a uniform cubic B-spline (de Boor, A Practical Guide
to Splines, 1978). Straight motion is reproduced exactly, the curve stays in the convex hull of the
points, and its velocity, acceleration and jerk are averages of the points' first, second and third
differences. A bound that holds for these differences therefore holds everywhere in between. Where
the points accelerate by a, the curve is off by a dt^2 / 6.

Rotations are interpolated as rotation vectors from the first orientation.
"""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.trajectory.chunk import NANOSECONDS, SetpointChunk
from lariat.trajectory.state import MotionState

SHORT_VECTOR = 0.5 * np.pi / np.sqrt(3.0)
"""Component up to which a rotation vector is shorter than a quarter turn [rad]."""


class Spline:
    """Uniform cubic B-spline of a chunk, which comes to rest after the last pose."""

    def __init__(self, chunk: SetpointChunk, start: int) -> None:
        """Build the curve of a chunk of at least two poses.

        Args:
            chunk: A chunk whose numbers are finite and whose quaternions have unit norm.
            start: Time of its first pose on the clock of the reader [ns].
        """
        self.start, self.dt = start, chunk.dt
        self.count = len(chunk.positions)
        self.first = chunk.orientations[0]
        points = np.stack([chunk.positions, rotation_vectors(chunk.orientations)], axis=2)
        # Extrapolate with the second difference, or the first velocity is half a dt late.
        second = points[2:3] - points[1:2] - (points[1:2] - points[:1]) if len(points) > 2 else 0.0
        before = 2.0 * points[:1] - points[1:2] + second
        self.points = np.concatenate([before, points, points[-1:], points[-1:]])
        """Control points, one before the first pose and two after the last: k+3 n 2 3."""
        self._latest: tuple[int, MotionState] | None = None
        """Time and state that were asked for last: several in turn ask for the same."""

    @property
    def end(self) -> int:
        """Time from which the curve rests [ns]."""
        return self.start + round(self.count * self.dt / NANOSECONDS)

    def differences(self, order: int) -> Float64[np.ndarray, "m n 2"]:
        """Return the norms of the points' differences over dt^order, the final rest included.

        Args:
            order: 1 for speeds [m/s, rad/s], 2 for accelerations, 3 for jerks.
        """
        steps = self.points[1:]
        for _ in range(order):
            steps = steps[1:] - steps[:-1]
        steps = steps / self.dt**order
        return np.sqrt(np.add.reduce(steps * steps, axis=-1))

    def __call__(self, now: int) -> MotionState:
        """Return the state at a time; before the first pose the curve goes on straight.

        Args:
            now: Time on the clock of the reader [ns].
        """
        if self._latest is None or self._latest[0] != now:
            self._latest = now, self._state(now)
        return self._latest[1]

    def _state(self, now: int) -> MotionState:
        u = (now - self.start) * NANOSECONDS / self.dt
        k = min(max(int(np.floor(u)), 0), self.count - 1)
        s = min(u - k, 1.0)
        p = self.points[k : k + 4]
        if s < 0.0:
            x, v, a = self._basis(p, 0.0)
            x, a = x + v * s * self.dt, np.zeros_like(a)
        else:
            x, v, a = self._basis(p, s)
        vector = x[:, 1]
        v[:, 1], a[:, 1] = angular_rate(vector, np.stack([v[:, 1], a[:, 1]]))
        turned = poses.multiply(poses.exponential(vector), self.first)
        return MotionState(x[:, 0], turned, v, a)

    def _basis(
        self, p: Float64[np.ndarray, "4 n 2 3"], s: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return value, first and second derivative in a segment at its parameter s in 0…1."""
        r = 1.0 - s
        x = np.array([r**3, 4 - 6 * s * s + 3 * s**3, 1 + 3 * s + 3 * s * s - 3 * s**3, s**3]) / 6
        v = np.array([-r * r, 3 * s * s - 4 * s, 1 + 2 * s - 3 * s * s, s * s]) / (2 * self.dt)
        a = np.array([r, 3 * s - 2, 1 - 3 * s, s]) / self.dt**2
        return tuple(np.einsum("k,knij->nij", weights, p) for weights in (x, v, a))


def rotation_vectors(orientations: Float64[np.ndarray, "k n 4"]) -> Float64[np.ndarray, "k n 3"]:
    """Return rotation vectors from the first orientation, in the world frame, unwrapped [rad]."""
    vectors = poses.logarithm(poses.multiply(orientations, poses.conjugate(orientations[:1])))
    # Vectors shorter than half of pi are less than half a turn apart.
    if np.abs(vectors).max() > SHORT_VECTOR and np.any(_turns(vectors[:-1], vectors[1:])):
        for before, after in pairwise(vectors):
            turns = _turns(before, after)
            after += 2.0 * np.pi * turns * _axis(after)
    return vectors


def _turns(
    before: Float64[np.ndarray, "*b 3"], after: Float64[np.ndarray, "*b 3"]
) -> Float64[np.ndarray, "*b 1"]:
    """Return the whole turns by which a rotation vector must grow to be near the one before it."""
    along = np.sum((before - after) * _axis(after), axis=-1, keepdims=True)
    return np.round(along / (2.0 * np.pi))


def _axis(vector: Float64[np.ndarray, "*b 3"]) -> Float64[np.ndarray, "*b 3"]:
    return vector / np.maximum(np.linalg.norm(vector, axis=-1, keepdims=True), 1e-12)


def angular_rate(
    vector: Float64[np.ndarray, "*b 3"], rate: Float64[np.ndarray, "*b 3"]
) -> Float64[np.ndarray, "*b 3"]:
    """Return the angular velocity of exp(vector) in the world frame [rad/s].

    This is the left Jacobian of SO(3) times the rate (Solà, Deray & Atchuthan, A micro Lie
    theory for state estimation in robotics, 2018, eq. (145)). Applied to the second derivative of
    the vector it is the angular acceleration except for products of rates, which feedback corrects.

    Args:
        vector: Rotation vector [rad].
        rate: Time derivative of the rotation vector [rad/s].
    """
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    turned = poses.cross(vector, rate)
    return rate + first * turned + second * poses.cross(vector, turned)

"""Setpoint chunks and the smooth reference that a gripper follows between them.

A chunk is a row of poses a constant time apart that ends at rest. Its points are the control
points of a uniform cubic B-spline: straight motion is reproduced exactly, the curve stays in the
hull of the points, and its speed, acceleration and jerk are averages of the points' first, second
and third differences. So what is checked on differences holds everywhere in between. The curve
rounds a bend off by a dt^2 / 6.

Times are integer nanoseconds of the local clock; orientations wxyz.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses

NANOSECONDS = 1e-9


@dataclass(frozen=True)
class Chunk:
    """Poses for the grippers of a cell, oldest first."""

    session: str
    """Of the writer; changes when it restarts."""
    sequence: int
    """Counts up within a session."""
    start: int
    """Time of the first pose, writer's clock [ns]."""
    dt: float
    """Between poses [s]."""
    positions: Float64[np.ndarray, "k n 3"]
    """World [m]."""
    orientations: Float64[np.ndarray, "k n 4"]
    """World, wxyz."""

    @property
    def span(self) -> float:
        """From the first pose to the last [s]."""
        return (len(self.positions) - 1) * self.dt


def rotation_vectors(orientations: Float64[np.ndarray, "k n 4"]) -> Float64[np.ndarray, "k n 3"]:
    """Rotations from the first orientation, in the world frame, without jumps [rad]."""
    first = poses.conjugate(orientations[:1])
    vectors = poses.logarithm(
        poses.multiply(orientations, np.broadcast_to(first, orientations.shape))
    )
    for before, after in pairwise(vectors):
        angle = np.linalg.norm(after, axis=-1, keepdims=True)
        axis = after / np.maximum(angle, 1e-12)
        turns = np.round(np.sum((before - after) * axis, axis=-1, keepdims=True) / (2.0 * np.pi))
        after += 2.0 * np.pi * turns * axis
    return vectors


def spatial_rate(
    vector: Float64[np.ndarray, "*b 3"], rate: Float64[np.ndarray, "*b 3"]
) -> Float64[np.ndarray, "*b 3"]:
    """Angular velocity in the world of exp(vector) when the vector changes at `rate` [rad/s].

    For a second derivative of the vector it is the angular acceleration but for products of rates,
    which feedback makes good.
    """
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    small = angle < 1e-4
    safe = np.where(small, 1.0, angle)
    first = np.where(small, 0.5, (1.0 - np.cos(safe)) / safe**2)
    second = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)
    turned = poses.cross(vector, rate)
    return rate + first * turned + second * poses.cross(vector, turned)


@dataclass(frozen=True)
class Sample:
    """Where a reference is at one time."""

    position: Float64[np.ndarray, "n 3"]
    """[m]"""
    orientation: Float64[np.ndarray, "n 4"]
    """wxyz"""
    velocity: Float64[np.ndarray, "n 2 3"]
    """Linear and angular [m/s, rad/s]."""
    acceleration: Float64[np.ndarray, "n 2 3"]
    """[m/s^2, rad/s^2]"""


class Spline:
    """A chunk as a curve; at rest from its last pose on."""

    def __init__(self, chunk: Chunk, start: int) -> None:
        """Args: chunk: A checked chunk. start: Time of its first pose on the local clock [ns]."""
        self.start, self.dt = start, chunk.dt
        self.count = len(chunk.positions)
        self.first = chunk.orientations[0]
        points = np.stack([chunk.positions, rotation_vectors(chunk.orientations)], axis=2)
        # The second difference goes on backwards, so that the first velocity is not half a dt late.
        second = np.diff(points[:3], n=2, axis=0)
        before = 2.0 * points[:1] - points[1:2] + (second if len(second) else 0.0)
        self.points = np.concatenate([before, points, points[-1:], points[-1:]])
        """Control points with one before the first pose and two after the last: k+3 n 2 3."""

    @property
    def end(self) -> int:
        """When the curve has come to rest [ns]."""
        return self.start + round((self.count) * self.dt / NANOSECONDS)

    def differences(self, order: int) -> Float64[np.ndarray, "m n 2"]:
        """Norms of the points' differences per dt^order, the rest at the end included."""
        steps = np.diff(self.points[1:], n=order, axis=0) / self.dt**order
        return np.linalg.norm(steps, axis=-1)

    def __call__(self, now: int) -> Sample:
        """The reference at a time [ns]; before the first pose it is continued straight."""
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
        v[:, 1], a[:, 1] = spatial_rate(vector, np.stack([v[:, 1], a[:, 1]]))
        turned = poses.multiply(poses.exponential(vector), self.first)
        return Sample(x[:, 0], turned, v, a)

    def _basis(
        self, p: Float64[np.ndarray, "4 n 2 3"], s: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        r = 1.0 - s
        x = np.array([r**3, 4 - 6 * s * s + 3 * s**3, 1 + 3 * s + 3 * s * s - 3 * s**3, s**3]) / 6
        v = np.array([-r * r, 3 * s * s - 4 * s, 1 + 2 * s - 3 * s * s, s * s]) / (2 * self.dt)
        a = np.array([r, 3 * s - 2, 1 - 3 * s, s]) / self.dt**2
        return tuple(np.einsum("k,knij->nij", weights, p) for weights in (x, v, a))


class Blend:
    """A spline with a fading offset, so that it takes over from any motion without a step.

    The offset is the quintic from the mismatch in position, velocity and acceleration to nothing.
    """

    def __init__(self, spline: Spline, origin: Sample, now: int, duration: float) -> None:
        """Args: origin: The motion to take over from at `now`. duration: Of the fade [s]."""
        self.spline, self.now, self.duration = spline, now, duration
        self._known: dict[int, Sample] = {}
        target = spline(now)
        back = poses.conjugate(target.orientation)
        self.position = np.stack(
            [
                origin.position - target.position,
                poses.logarithm(poses.multiply(origin.orientation, back)),
            ],
            axis=1,
        )
        self.velocity = origin.velocity - target.velocity
        self.acceleration = origin.acceleration - target.acceleration

    @property
    def end(self) -> int:
        """When both spline and fade are over [ns]."""
        return max(self.spline.end, self.now + round(self.duration / NANOSECONDS))

    def __call__(self, now: int) -> Sample:
        """The reference at a time not before the blend began [ns]."""
        # A tick asks for where it begins and, twice, for where it ends.
        if now not in self._known:
            if len(self._known) == 2:
                del self._known[min(self._known)]
            self._known[now] = self._sample(now)
        return self._known[now]

    def _sample(self, now: int) -> Sample:
        target = self.spline(now)
        T = self.duration
        s = (now - self.now) * NANOSECONDS / T
        if s >= 1.0:
            return target
        x = self._fade(
            1 - s**3 * (10 - s * (15 - 6 * s)),
            s - s**3 * (6 - s * (8 - 3 * s)),
            s * s / 2 - s**3 * (1.5 - s * (1.5 - s / 2)),
        )
        v = self._fade(
            -30 * s * s * (1 - s) ** 2,
            1 - s * s * (18 - s * (32 - 15 * s)),
            s - s * s * (4.5 - s * (6 - 2.5 * s)),
        )
        a = self._fade(
            -60 * s * (1 - s) * (1 - 2 * s),
            -s * (36 - s * (96 - 60 * s)),
            1 - s * (9 - s * (18 - 10 * s)),
        )
        return Sample(
            target.position + x[:, 0],
            poses.multiply(poses.exponential(x[:, 1]), target.orientation),
            target.velocity + v / T,
            target.acceleration + a / T**2,
        )

    def _fade(self, position: float, velocity: float, acceleration: float) -> np.ndarray:
        T = self.duration
        return (
            position * self.position
            + velocity * T * self.velocity
            + acceleration * T**2 * self.acceleration
        )

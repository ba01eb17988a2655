"""What the emulated arm can be doing: each motion says where the joints shall be next."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from jaxtyping import Float64

from services.cr5_emulator.geometry import Geometry, Joints, Transform

JOINT_RANGE = np.radians([360.0, 360.0, 160.0, 360.0, 360.0, 360.0])
JOINT_SPEED = np.pi
"""[rad/s]"""
JOINT_ACCELERATION = 8.0
"""Of planned motions at 100 % [rad/s^2]."""
JOINT_BRAKING = 20.0
"""Of stops [rad/s^2]."""
LINEAR_SPEED = 2.0
"""At 100 % [m/s]."""
LINEAR_ACCELERATION = 4.0
"""At 100 % [m/s^2]."""
NEAR_SINGULAR = 0.02
"""Sine, or metres for the shoulder, below which a line stops."""
NEAR_PLANNED = 0.05
"""The same for the points of a line that are tried before it begins."""


class Alarm(Exception):  # it is one, with the maker's number
    """The controller raises an alarm."""

    def __init__(self, *numbers: int) -> None:
        super().__init__(numbers)
        self.numbers = numbers


class Motion(Protocol):
    """One entry of the queue while it runs."""

    done: bool
    progress: float
    """From 0 to 1; 0 of motions without an end."""

    def advance(self, joints: Joints, h: float) -> Joints:
        """Where the joints shall be `h` [s] later; may raise Alarm."""
        ...


def singularity(geometry: Geometry, joints: Joints, near: float = NEAR_SINGULAR) -> int | None:
    """0 at the shoulder, 1 at the wrist, 2 at the elbow, None elsewhere."""
    if abs(np.sin(joints[4])) < near:
        return 1
    if abs(np.sin(joints[2])) < near:
        return 2
    frames = geometry.frames(joints)
    # Axes 5 and 6 cross in the plane of axes 1 and 2 when the crossing is d4 from axis 1.
    crossing = frames[5, :3, 3]
    in_plane = np.hypot(crossing[0], crossing[1]) ** 2 - geometry.d[3] ** 2
    return 0 if in_plane < near**2 else None


def check_range(
    joints: Joints,
    limits: Float64[np.ndarray, "6 2"] | None = None,
    before: Joints | None = None,
) -> None:
    """Raises the alarm of the first joint that is past its end.

    Args:
        limits: Least and greatest angle [rad]; without them what the arm is built for.
        before: Where the joints come from: the way back within the limits is free.
    """
    low, high = (-JOINT_RANGE, JOINT_RANGE) if limits is None else limits.T
    past = np.maximum(joints - high, low - joints)
    if before is not None:
        past = np.where(past > np.maximum(before - high, low - before), past, 0.0)
    for k in np.nonzero(past > 0.0)[0]:
        raise Alarm(64 + 2 * int(k) + (0 if joints[k] > high[k] else 1))


@dataclass(frozen=True)
class Trapezoid:
    """Progress from 0 to 1 with bounded rate and acceleration."""

    rate: float
    acceleration: float

    @property
    def duration(self) -> float:
        ramp = self._ramp
        return 2.0 * ramp + max(1.0 / self._peak - ramp, 0.0)

    @property
    def _peak(self) -> float:
        return min(self.rate, np.sqrt(self.acceleration))

    @property
    def _ramp(self) -> float:
        return self._peak / self.acceleration

    def __call__(self, t: float) -> float:
        ramp, end = self._ramp, self.duration
        t = min(max(t, 0.0), end)
        if t < ramp:
            return 0.5 * self.acceleration * t * t
        if t > end - ramp:
            return 1.0 - 0.5 * self.acceleration * (end - t) ** 2
        return 0.5 * self.acceleration * ramp * ramp + self._peak * (t - ramp)


class JointMotion:
    """All joints arrive together."""

    def __init__(self, start: Joints, target: Joints, speed: float, acceleration: float) -> None:
        """Args: speed, acceleration: Fractions of what the arm can do."""
        check_range(target)
        self._start, self._way = start, target - start
        size = max(float(np.max(np.abs(self._way))), 1e-9)
        self._profile = Trapezoid(
            speed * JOINT_SPEED / size, acceleration * JOINT_ACCELERATION / size
        )
        self._time, self.done, self.progress = 0.0, False, 0.0

    def advance(self, joints: Joints, h: float) -> Joints:
        self._time += h
        self.done = self._time >= self._profile.duration
        self.progress = self._profile(self._time)
        return self._start + self.progress * self._way


class LineMotion:
    """The flange on a straight line, turning at a constant rate."""

    def __init__(
        self,
        geometry: Geometry,
        start: Joints,
        path: Callable[[float], Transform],
        length: float,
        speed: float,
        acceleration: float,
    ) -> None:
        """Args: path: Pose at a progress from 0 to 1. length: Of the way [m]. speed: [m/s]."""
        self._geometry, self._path = geometry, path
        length = max(length, 1e-4)
        self._profile = Trapezoid(speed / length, acceleration / length)
        self._time, self.done, self.progress = 0.0, False, 0.0
        joints = start
        for progress in np.linspace(0.0, 1.0, 26)[1:]:
            solved = geometry.solve(path(float(progress)), joints)
            if solved is None:
                raise Alarm(17)
            if np.max(np.abs(solved - joints)) > 1.0:
                raise Alarm((16, 26, 27)[singularity(geometry, solved) or 0])
            joints = solved
            check_range(joints)
            kind = singularity(geometry, joints, NEAR_PLANNED)
            if kind is not None:
                raise Alarm((16, 26, 27)[kind])

    def advance(self, joints: Joints, h: float) -> Joints:
        self._time += h
        self.done = self._time >= self._profile.duration
        self.progress = self._profile(self._time)
        solved = self._geometry.solve(self._path(self.progress), joints)
        if solved is None:
            raise Alarm(33)
        kind = singularity(self._geometry, solved)
        if kind is not None:
            raise Alarm((32, 35, 36)[kind])
        for k in np.nonzero(np.abs(solved - joints) > JOINT_SPEED * h * 1.05)[0]:
            raise Alarm(48 + int(k))
        return solved


class ServoMotion:
    """Points that arrive one by one; each is reached after its own time."""

    def __init__(self, limits_speed: bool) -> None:
        """Args: limits_speed: Whether a point too far is reached late instead of an alarm."""
        self._limits_speed = limits_speed
        self._target: Joints | None = None
        self._left = 0.0
        self.done = True
        self.arrived_ago = 0.0
        """Since the last point [s]."""

    def aim(self, joints: Joints, target: Joints, t: float) -> None:
        """A new point, to be reached in `t` [s] from where the joints are."""
        check_range(target)
        fast = np.abs(target - joints) / t > JOINT_SPEED
        if np.any(fast):
            if not self._limits_speed:
                raise Alarm(48 + int(np.argmax(fast)))
            t = float(np.max(np.abs(target - joints))) / JOINT_SPEED
        self._target, self._left = target, t
        self.done, self.arrived_ago = False, 0.0

    def advance(self, joints: Joints, h: float) -> Joints:
        self.arrived_ago += h
        if self._target is None or self.done:
            return joints
        if self._left <= h:
            self._left, self.done = 0.0, True
            return self._target
        joints = joints + (self._target - joints) * (h / self._left)
        self._left -= h
        return joints


class JogMotion:
    """One joint, or the flange along one axis, at a constant speed until it is stopped."""

    def __init__(self, geometry: Geometry, rate: Joints | None, twist: np.ndarray | None) -> None:
        """Args: rate: Of the joints [rad/s], or twist: of the flange in the base [m/s, rad/s]."""
        self._geometry, self._rate, self._twist = geometry, rate, twist
        self.done, self.progress = False, 0.0

    def advance(self, joints: Joints, h: float) -> Joints:
        rate = self._rate
        if rate is None:
            J = self._geometry.jacobian(self._geometry.frames(joints))
            rate = np.linalg.solve(J.T @ J + 1e-6 * np.eye(6), J.T @ self._twist)
        joints = joints + rate * h
        check_range(joints)
        return joints


class Braking:
    """A stop from a speed of the joints."""

    def __init__(self, speed: Joints) -> None:
        self._speed = speed
        self.done = False

    def advance(self, joints: Joints, h: float) -> Joints:
        size = float(np.max(np.abs(self._speed)))
        left = max(size - JOINT_BRAKING * h, 0.0)
        after = self._speed * (left / max(size, 1e-12))
        joints = joints + (self._speed + after) * (h / 2.0)
        self._speed, self.done = after, left == 0.0
        return joints


class Delay:
    """Stands still for a while."""

    def __init__(self, seconds: float) -> None:
        self._left = seconds
        self.done, self.progress = False, 0.0

    def advance(self, joints: Joints, h: float) -> Joints:
        self._left -= h
        self.done = self._left <= 0.0
        return joints


@dataclass(frozen=True)
class Trigger:
    """An output that switches on the way."""

    distance: float
    """From the start when positive, from the end when negative; in percent or in mm or degrees."""
    percent: bool
    switch: Callable[[], None]

    def share(self, length: float) -> float:
        """Progress at which it switches, from 0 to 1."""
        share = self.distance / (100.0 if self.percent else max(length, 1e-9))
        return min(max(share if self.distance >= 0.0 else 1.0 + share, 0.0), 1.0)


class Triggered:
    """A motion that switches outputs on its way."""

    def __init__(self, motion: Motion, length: float, triggers: tuple[Trigger, ...]) -> None:
        """Args: length: Of the way, in mm or degrees as the triggers count."""
        self._motion = motion
        self._waiting = sorted(((t.share(length), k, t) for k, t in enumerate(triggers)))
        self.done, self.progress = False, 0.0

    def advance(self, joints: Joints, h: float) -> Joints:
        joints = self._motion.advance(joints, h)
        self.done, self.progress = self._motion.done, self._motion.progress
        while self._waiting and self._waiting[0][0] <= self.progress + 1e-9:
            self._waiting.pop(0)[2].switch()
        return joints

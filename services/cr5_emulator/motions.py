"""Motions of the emulated arm: each computes the next commanded joint angles."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from services.cr5_emulator.kinematics import Geometry, Joints, Transform

JOINT_RANGE = np.radians([360.0, 360.0, 160.0, 360.0, 360.0, 360.0])
"""Largest angle of each joint, either way [rad]."""
JOINT_SPEED = np.pi
"""Maximum speed of every joint [rad/s]."""
JOINT_ACCELERATION = 8.0
"""Joint acceleration of planned motions at 100 % [rad/s^2]."""
JOINT_DECELERATION = 20.0
"""Joint deceleration of a stop [rad/s^2]."""
LINEAR_SPEED = 2.0
"""Speed of the flange at 100 % [m/s]."""
LINEAR_ACCELERATION = 4.0
"""Acceleration of the flange at 100 % [m/s^2]."""
SINGULARITY_MARGIN = 0.02
"""Distance to a singularity below which a line stops: a sine, metres at the shoulder."""
PLANNED_SINGULARITY_MARGIN = 0.05
"""Distance to a singularity below which a line is refused before it begins; units as above."""
PLANNED_POINT_COUNT = 25
"""Number of points of a line that are checked before it begins."""
PLANNED_JOINT_STEP = 1.0
"""Change of a joint between two checked points above which the branch has changed [rad]."""
PLANNED_SINGULARITY_ALARMS = (16, 26, 27)
"""Alarms of a planned point near a singularity: shoulder, wrist, elbow."""
MOVING_SINGULARITY_ALARMS = (32, 35, 36)
"""Alarms of a motion near a singularity: shoulder, wrist, elbow."""


class Alarm(Exception):
    """Alarms of the controller, by the vendor's numbers."""

    def __init__(self, *numbers: int) -> None:
        super().__init__(numbers)
        self.numbers = numbers


class Motion(Protocol):
    """A motion while it runs."""

    done: bool

    def advance(self, joints: Joints, h: float) -> Joints:
        """Return the joint angles `h` [s] later; raises Alarm."""
        ...


def singularity(geometry: Geometry, joints: Joints, near: float = SINGULARITY_MARGIN) -> int | None:
    """Return the kind of singularity: 0 shoulder, 1 wrist, 2 elbow, None elsewhere."""
    if abs(np.sin(joints[4])) < near:
        return 1
    if abs(np.sin(joints[2])) < near:
        return 2
    frames = geometry.frames(joints)
    # Axes 5 and 6 intersect in the plane of axes 1 and 2 if the point is d4 from axis 1.
    crossing = frames[5, :3, 3]
    in_plane = np.hypot(crossing[0], crossing[1]) ** 2 - geometry.d[3] ** 2
    return 0 if in_plane < near**2 else None


def check_range(joints: Joints, before: Joints | None = None) -> None:
    """Raise the alarm of the first joint past its end; motion back into the range is allowed."""
    excess = np.abs(joints) - JOINT_RANGE
    if before is not None:
        excess = np.where(excess > np.abs(before) - JOINT_RANGE, excess, 0.0)
    for k in np.nonzero(excess > 0.0)[0]:
        raise Alarm(64 + 2 * int(k) + (0 if joints[k] > 0.0 else 1))


@dataclass(frozen=True)
class Trapezoid:
    """Trapezoidal velocity profile of a progress from 0 to 1."""

    rate: float
    """Greatest rate of the progress [1/s]."""
    acceleration: float
    """Acceleration of the progress [1/s^2]."""

    @property
    def duration(self) -> float:
        """Time from 0 to 1 [s]."""
        ramp = self._ramp
        return 2.0 * ramp + max(1.0 / self._peak - ramp, 0.0)

    @property
    def _peak(self) -> float:
        return min(self.rate, np.sqrt(self.acceleration))

    @property
    def _ramp(self) -> float:
        return self._peak / self.acceleration

    def __call__(self, t: float) -> float:
        """Return the progress at a time [s]."""
        ramp, end = self._ramp, self.duration
        t = min(max(t, 0.0), end)
        if t < ramp:
            return 0.5 * self.acceleration * t * t
        if t > end - ramp:
            return 1.0 - 0.5 * self.acceleration * (end - t) ** 2
        return 0.5 * self.acceleration * ramp * ramp + self._peak * (t - ramp)


class JointMotion:
    """Joint-space motion; all joints arrive together."""

    def __init__(self, start: Joints, target: Joints, speed: float, acceleration: float) -> None:
        """Args: speed, acceleration: Fractions of the arm's maximum."""
        check_range(target)
        self._start, self._displacement = start, target - start
        size = max(float(np.max(np.abs(self._displacement))), 1e-9)
        self._profile = Trapezoid(
            speed * JOINT_SPEED / size, acceleration * JOINT_ACCELERATION / size
        )
        self._time, self.done = 0.0, False

    def advance(self, joints: Joints, h: float) -> Joints:
        self._time += h
        self.done = self._time >= self._profile.duration
        return self._start + self._profile(self._time) * self._displacement


class LineMotion:
    """Cartesian motion of the flange along a path."""

    def __init__(
        self,
        geometry: Geometry,
        start: Joints,
        path: Callable[[float], Transform],
        length: float,
        speed: float,
        acceleration: float,
    ) -> None:
        """Args: path: Pose at a progress from 0 to 1. length: Path length [m]. speed: [m/s]."""
        self._geometry, self._path = geometry, path
        length = max(length, 1e-4)
        self._profile = Trapezoid(speed / length, acceleration / length)
        self._time, self.done = 0.0, False
        joints = start
        for progress in np.linspace(0.0, 1.0, PLANNED_POINT_COUNT + 1)[1:]:
            solved = geometry.solve(path(float(progress)), joints)
            if solved is None:
                raise Alarm(17)
            if np.max(np.abs(solved - joints)) > PLANNED_JOINT_STEP:
                raise Alarm(PLANNED_SINGULARITY_ALARMS[singularity(geometry, solved) or 0])
            joints = solved
            check_range(joints)
            kind = singularity(geometry, joints, PLANNED_SINGULARITY_MARGIN)
            if kind is not None:
                raise Alarm(PLANNED_SINGULARITY_ALARMS[kind])

    def advance(self, joints: Joints, h: float) -> Joints:
        self._time += h
        self.done = self._time >= self._profile.duration
        solved = self._geometry.solve(self._path(self._profile(self._time)), joints)
        if solved is None:
            raise Alarm(33)
        kind = singularity(self._geometry, solved)
        if kind is not None:
            raise Alarm(MOVING_SINGULARITY_ALARMS[kind])
        for k in np.nonzero(np.abs(solved - joints) > JOINT_SPEED * h * 1.05)[0]:
            raise Alarm(48 + int(k))
        return solved


class ServoMotion:
    """Motion through servo points, each reached after its own time."""

    def __init__(self, limits_speed: bool) -> None:
        """Args: limits_speed: Whether a point too far away is reached later instead of an alarm."""
        self._limits_speed = limits_speed
        self._target: Joints | None = None
        self._remaining = 0.0
        self.done = True
        self.arrived_ago = 0.0
        """Time since the last point [s]."""

    def aim(self, joints: Joints, target: Joints, t: float) -> None:
        """Set a new point, to be reached in `t` [s]; raises Alarm."""
        check_range(target)
        fast = np.abs(target - joints) / t > JOINT_SPEED
        if np.any(fast):
            if not self._limits_speed:
                raise Alarm(48 + int(np.argmax(fast)))
            t = float(np.max(np.abs(target - joints))) / JOINT_SPEED
        self._target, self._remaining = target, t
        self.done, self.arrived_ago = False, 0.0

    def advance(self, joints: Joints, h: float) -> Joints:
        self.arrived_ago += h
        if self._target is None or self.done:
            return joints
        if self._remaining <= h:
            self._remaining, self.done = 0.0, True
            return self._target
        joints = joints + (self._target - joints) * (h / self._remaining)
        self._remaining -= h
        return joints


class JogMotion:
    """Jog of one joint, or of the flange along one axis, at a constant speed until stopped."""

    def __init__(self, geometry: Geometry, rate: Joints | None, twist: np.ndarray | None) -> None:
        """Args: rate: Joint speeds [rad/s], or twist: of the flange in the base [m/s, rad/s]."""
        self._geometry, self._rate, self._twist = geometry, rate, twist
        self.done = False

    def advance(self, joints: Joints, h: float) -> Joints:
        rate = self._rate
        if rate is None:
            J = self._geometry.jacobian(self._geometry.frames(joints))
            rate = np.linalg.solve(J.T @ J + 1e-6 * np.eye(6), J.T @ self._twist)
        joints = joints + rate * h
        check_range(joints)
        return joints


class Braking:
    """Stop from a joint speed, at constant deceleration."""

    def __init__(self, speed: Joints) -> None:
        self._speed = speed
        self.done = False

    def advance(self, joints: Joints, h: float) -> Joints:
        size = float(np.max(np.abs(self._speed)))
        left = max(size - JOINT_DECELERATION * h, 0.0)
        after = self._speed * (left / max(size, 1e-12))
        joints = joints + (self._speed + after) * (h / 2.0)
        self._speed, self.done = after, left == 0.0
        return joints

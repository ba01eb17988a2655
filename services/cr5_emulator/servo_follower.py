"""Response of the drives to servo points: delay, lag, and reaction when points stop."""

from __future__ import annotations

from collections import deque

import numpy as np

from services.cr5_emulator.kinematics import Joints
from services.cr5_emulator.motions import JOINT_SPEED, Alarm, ServoMotion
from services.cr5_emulator.options import EmulatorOptions

TRACKING_LIMIT_ALARM = 194
"""Alarm number."""
NOMINAL_LOOKAHEAD, NOMINAL_GAIN = 50.0, 500.0
"""Arguments of a servo point for which the lag is that of the options."""


class ServoFollower:
    """Servo points of one client and the motion between them."""

    def __init__(self, options: EmulatorOptions) -> None:
        self._options = options
        self._servo = ServoMotion(limits_speed=options.firmware == "v4")
        self._jitter = np.random.default_rng(options.seed)
        self._delayed: deque[tuple[float, Joints, float]] = deque()
        self._expects_point = False
        """Whether another point is expected after the last one."""
        self.lag = options.servo_lag
        """Time constant of the drives [s]."""
        self.braking_from: Joints | None = None
        """Joint speed from which to brake because no point came [rad/s]; None: no braking."""

    @property
    def pending(self) -> bool:
        """Whether a received point has not taken effect yet."""
        return bool(self._delayed)

    @property
    def arrived(self) -> bool:
        """Whether the last point was reached."""
        return self._servo.done

    @property
    def active(self) -> bool:
        """Whether the arm follows points, or reacts to their absence."""
        return self._expects_point or not self._servo.done

    def drop(self) -> None:
        """Discard all points."""
        self._delayed.clear()
        self._servo = ServoMotion(limits_speed=self._options.firmware == "v4")
        self._expects_point = False

    def aim(
        self, now: float, joints: Joints, target: Joints, t: float, lookahead: float, gain: float
    ) -> None:
        """Take a new point [rad], to be reached in `t`, at a time since the arm was switched on."""
        self.lag = self._options.servo_lag * (lookahead / NOMINAL_LOOKAHEAD) * (NOMINAL_GAIN / gain)
        delay = self._options.servo_jitter * float(self._jitter.random())
        self._delayed.append((now + delay, target, t))
        if delay == 0.0:
            self.aim_due(now, joints)

    def aim_due(self, now: float, joints: Joints) -> None:
        """Apply the points whose delay is over."""
        while self._delayed and self._delayed[0][0] <= now:
            _, target, t = self._delayed.popleft()
            self._servo.aim(joints, target, t)
            self._expects_point = True

    def advance(self, joints: Joints, speed: Joints, h: float) -> Joints:
        """Return the joint angles `h` [s] later; raises Alarm."""
        target = self._servo.advance(joints, h)
        if not self._servo.done:
            return target
        late = self._servo.arrived_ago > self._options.silence_time
        match self._options.silence:
            case "hold":
                self._expects_point = False
            case "coast":
                speed = np.clip(speed, -JOINT_SPEED, JOINT_SPEED)
                if late:
                    self._expects_point, self.braking_from = False, speed
                return joints + speed * h
            case "alarm":
                if late:
                    self._expects_point = False
                    raise Alarm(TRACKING_LIMIT_ALARM)
        return target

"""Servo points as the drives take them: delayed, followed with a lag, and missed when they stop."""

from __future__ import annotations

from collections import deque

import numpy as np

from services.cr5_emulator.geometry import Joints
from services.cr5_emulator.motions import JOINT_SPEED, Alarm, ServoMotion
from services.cr5_emulator.options import Options

TRACKING_LIMIT = 194
LOOKAHEAD, GAIN = 50.0, 500.0
"""At which the lag is the one of the options."""


class Stream:
    """The points of one client."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._servo = ServoMotion(limits_speed=options.firmware == "v4")
        self._jitter = np.random.default_rng(options.seed)
        self._delayed: deque[tuple[float, Joints, float]] = deque()
        self._missed = False
        """Whether points may still be waited for since the last one was reached."""
        self.lag = options.servo_lag
        """Time constant of the drives [s]."""
        self.braking_from: Joints | None = None
        """Speed from which the arm shall brake because no point came [rad/s]."""

    @property
    def waits(self) -> bool:
        """Whether a point has not taken effect yet."""
        return bool(self._delayed)

    @property
    def arrived(self) -> bool:
        """Whether the last point was reached."""
        return self._servo.done

    @property
    def leads(self) -> bool:
        """Whether the arm follows points, or does what it does when they stop."""
        return self._missed or not self._servo.done

    def drop(self) -> None:
        """Forgets every point."""
        self._delayed.clear()
        self._servo = ServoMotion(limits_speed=self._options.firmware == "v4")
        self._missed = False

    def aim(
        self, now: float, here: Joints, target: Joints, t: float, lookahead: float, gain: float
    ) -> None:
        """A new point; may raise Alarm.

        Args:
            now: Since the start of the arm [s].
            here: Where the joints are led to be now [rad].
            t: In which the point is to be reached [s].
        """
        self.lag = self._options.servo_lag * (lookahead / LOOKAHEAD) * (GAIN / gain)
        delay = self._options.servo_jitter * float(self._jitter.random())
        self._delayed.append((now + delay, target, t))
        if delay == 0.0:
            self.aim_due(now, here)

    def aim_due(self, now: float, here: Joints) -> None:
        """Lets the points take effect whose time has come."""
        while self._delayed and self._delayed[0][0] <= now:
            _, target, t = self._delayed.popleft()
            self._servo.aim(here, target, t)
            self._missed = True

    def advance(self, here: Joints, speed: Joints, h: float) -> Joints:
        """Where the joints shall be `h` [s] later; may raise Alarm."""
        target = self._servo.advance(here, h)
        if not self._servo.done:
            return target
        late = self._servo.arrived_ago > self._options.silence_time
        match self._options.silence:
            case "hold":
                self._missed = False
            case "coast":
                speed = np.clip(speed, -JOINT_SPEED, JOINT_SPEED)
                if late:
                    self._missed, self.braking_from = False, speed
                return here + speed * h
            case "alarm":
                if late:
                    self._missed = False
                    raise Alarm(TRACKING_LIMIT)
        return target

"""All arms of a cell together: commands go out, and what they say of themselves comes in."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence

import numpy as np

from lariat.geometry.poses import Pose
from lariat.trajectory import NANOSECONDS
from services.robot_gateway.drivers.driver import Driver, Feedback
from services.robot_gateway.motion import approach
from services.robot_gateway.motion.follower import Guidance
from services.robot_gateway.safety.state_machine import Command, Rejected

SIDES = ("left", "right")

LAG = 0.5
"""How far back the command is searched for where an arm is now [s]."""
STILL = (0.01, 0.05)
"""Linear and angular speed of a gripper below which its arm rests [m/s, rad/s]."""


class Arms:
    """Drivers of all ends, left first."""

    def __init__(self, drivers: Sequence[Driver], starts: Sequence[Pose]) -> None:
        """Args: starts: Grips of all ends at the scenario's start."""
        self.drivers = tuple(drivers)
        self.starts = tuple(starts)
        self.grips = list(starts)
        """Of all ends, as measured when the cell last came to rest for a person."""
        self.feedback: tuple[Feedback, ...] = ()
        self._trail: deque[tuple[int, np.ndarray]] = deque()
        self._lags: list[float] | None = None
        """Until the next exchange."""
        self.powered = False
        """Whether they have had power since it was last taken from them."""

    def exchange(self, now: int, guidance: Guidance, live: Sequence[bool]) -> None:
        """Commands to the arms, feedback from them. Args: live: Which ends are sent points."""
        rows = []
        driven = iter(guidance.grips())
        for driver, goes in zip(self.drivers, live, strict=True):
            pose, velocity = next(driven) if driver.moves else (None, np.zeros((2, 3)))
            rows.append(driver.step(now, pose if goes else None, velocity))
        self.feedback = tuple(rows)
        self._trail.append((now, guidance.state.positions))
        while (now - self._trail[0][0]) * NANOSECONDS > LAG:
            self._trail.popleft()
        self._lags = None

    def measure(self, guidance: Guidance) -> None:
        """Starts the command from where the arms are."""
        for k, feedback in enumerate(self.feedback):
            if feedback.pose is not None:
                self.grips[k] = feedback.pose
            posture = self.drivers[k].posture
            if posture is not None and feedback.joints:
                posture.begin(feedback.joints)
        guidance.place(self.grips)
        self._trail.clear()
        self._lags = None

    # What they are told

    def enable(self) -> None:
        self.powered = True
        for driver in self.drivers:
            driver.enable()

    def recover(self) -> None:
        self.powered = True
        for driver in self.drivers:
            driver.recover()

    def disable(self) -> None:
        """Takes the power off arms that rest, once after each time they had it."""
        if self.powered:
            self.powered = False
            for driver in self.drivers:
                driver.disable()

    def close(self) -> None:
        """Ends the connections to the arms."""
        for driver in self.drivers:
            driver.close()

    def place(self, ends: Sequence[int]) -> None:
        """Puts some ends where the scenario begins; simulation only."""
        for k in ends:
            if self.drivers[k].place(self.starts[k]):
                self.grips[k] = self.starts[k]

    def grip(self, command: Command) -> None:
        """Opens or closes a gripper; raises Rejected."""
        if command.arm not in SIDES:
            raise Rejected(f"there is no arm {command.arm!r}; there are {', '.join(SIDES)}")
        driver = self.drivers[SIDES.index(command.arm)]
        if not driver.moves:
            raise Rejected(f"{command.arm} is fixed and has no gripper")
        driver.grip(command.close)

    # How they are

    @property
    def on_their_own(self) -> bool:
        """Whether any of them is a device, which may be elsewhere than it is commanded to be."""
        return any(d.moves and np.isfinite(d.tracking_limit) for d in self.drivers)

    @property
    def still(self) -> bool:
        """Whether no arm moves: they follow their command some time behind it."""
        speeds = [np.linalg.norm(f.velocity, axis=-1) for f in self.feedback]
        return all(bool(np.all(speed < STILL)) for speed in speeds)

    @property
    def sound(self) -> list[bool]:
        """Which of them report no fault."""
        faults = [feedback.fault for feedback in self.feedback] or [""] * len(self.drivers)
        return [not fault for fault in faults]

    @property
    def ready(self) -> bool:
        """Whether all can follow and it is known where they are."""
        return all(f.ready and f.pose is not None for f in self.feedback)

    @property
    def pulls(self) -> list[float]:
        """Change of the force at every gripper since it was armed [N]."""
        return [feedback.pull for feedback in self.feedback]

    @property
    def away(self) -> list[int]:
        """Driven ends that are not at the scenario's start."""
        return [
            k
            for k, driver in enumerate(self.drivers)
            if driver.moves and approach.is_away(self.grips[k], self.starts[k])
        ]

    @property
    def trouble(self) -> str:
        """What keeps them from being armed, in words; empty when nothing does."""
        for name, feedback in zip(SIDES, self.feedback, strict=False):
            words = "; ".join(feedback.alarms)
            if feedback.fault:
                return f"{name}: {words or feedback.fault}"
            if feedback.pose is None:
                return f"{name}: {words or 'its pose is not known yet'}"
        return "" if self.feedback else "the arms have not been heard yet"

    @property
    def unready(self) -> str:
        """Those that are not ready, with their reasons."""
        return ", ".join(
            f"{name}: {'; '.join(feedback.alarms) or 'not ready'}"
            for name, feedback in zip(SIDES, self.feedback, strict=False)
            if not feedback.ready
        )

    def near(self, factor: float) -> list[bool]:
        """Which are within `factor` times their tracking limit of their path."""
        limits = [factor * driver.tracking_limit for driver in self.drivers]
        if not self.feedback:
            return [True] * len(limits)
        return [lag <= limit for lag, limit in zip(self.lags(), limits, strict=True)]

    def lags(self) -> list[float]:
        """Distance of every arm to the nearest place it was commanded to be lately [m].

        An arm follows some time behind; what counts is how far it is off its path.
        """
        if self._lags is None:
            self._lags = self._find_lags()
        return self._lags

    def _find_lags(self) -> list[float]:
        rows = []
        driven = -1
        for driver, feedback in zip(self.drivers, self.feedback, strict=True):
            driven += driver.moves
            if not driver.moves or np.isinf(driver.tracking_limit):
                rows.append(0.0)
                continue
            trail = [p[driven] for _, p in self._trail]
            if feedback.pose is None or not trail:
                rows.append(0.0)
            else:
                gaps = np.linalg.norm(np.array(trail) - feedback.pose.position, axis=1)
                rows.append(float(np.min(gaps)))
        return rows

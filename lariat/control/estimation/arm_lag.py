"""Lag of the arms behind their setpoints, estimated while they move.

An arm that follows setpoints through a controller of its own executes them late. The lag is
estimated by least squares from the distance between commanded and measured grips along the
commanded velocity, so that predictions begin where new setpoints reach the rope.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np

from lariat.trajectory import NANOSECONDS, MotionState, mean_twists

CR5_LAG = 0.065
"""Lag of a CR5 behind its setpoints, as measured with its emulator [s]."""


@dataclass(frozen=True)
class ArmLagSettings:
    """Bounds and memory of the estimate."""

    max_lag: float = 0.2
    """Largest lag [s]."""
    memory_time: float = 2.0
    """Time constant with which evidence decays [s]."""
    expected_lag: float = 0.0
    """Lag before the arms have moved [s]."""
    prior_travel: float = 2e-5
    """Weight of the expected lag: integral of the squared speed that outweighs it [m^2/s]."""


class ArmLag:
    """Estimator of one lag for all arms."""

    def __init__(self, settings: ArmLagSettings | None = None) -> None:
        """Create an estimator of arms that have not moved yet.

        Args:
            settings: Bounds and memory.
        """
        self.settings = settings or ArmLagSettings()
        self.lag = self.settings.expected_lag
        """Lag [s]."""
        self._squares = self._products = 0.0
        self.restart()

    def restart(self) -> None:
        """Forget the commanded motion, which begins anew; the lag is kept."""
        self._commanded: deque[tuple[int, MotionState]] = deque()

    def observe(self, time: int, commanded: MotionState, measured: MotionState) -> None:
        """Take in where the grips are and where they were commanded to be.

        Args:
            time: Time of both [ns].
            commanded: Commanded motion.
            measured: Measured motion.
        """
        settings = self.settings
        if self._commanded and time <= self._commanded[-1][0]:
            return
        elapsed = NANOSECONDS * (time - self._commanded[-1][0]) if self._commanded else 0.0
        self._commanded.append((time, commanded))
        while NANOSECONDS * (time - self._commanded[0][0]) > settings.max_lag + elapsed:
            self._commanded.popleft()
        executed = self.executed(time)
        velocity = executed.twists[:, 0]
        # Linearized at the present estimate: the distance that is left adds to it.
        behind = executed.positions - measured.positions + self.lag * velocity
        decay = math.exp(-elapsed / settings.memory_time)
        self._squares = decay * self._squares + elapsed * float(np.sum(velocity**2))
        self._products = decay * self._products + elapsed * float(np.sum(velocity * behind))
        expected = settings.prior_travel * settings.expected_lag
        lag = (self._products + expected) / (self._squares + settings.prior_travel)
        self.lag = min(max(lag, 0.0), settings.max_lag)

    def executed(self, time: int) -> MotionState:
        """Commanded motion that the arms execute at a time: the one a lag before it.

        Args:
            time: Time not after the last observation [ns].
        """
        at = time - round(self.lag / NANOSECONDS)
        before = after = self._commanded[0]
        for entry in self._commanded:
            before, after = after, entry
            if entry[0] >= at:
                break
        if at <= before[0] or before[0] == after[0]:
            return before[1] if at <= before[0] else after[1]
        share = min((at - before[0]) / (after[0] - before[0]), 1.0)
        travel = share * mean_twists(before[1], after[1], 1.0)
        twists = (1.0 - share) * before[1].twists + share * after[1].twists
        return before[1].moved(travel, twists, before[1].accelerations)

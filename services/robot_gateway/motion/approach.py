"""The slow way of arms from where they are to the scenario's start, to which a person agrees."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import NANOSECONDS, SetpointChunk

SPEED = 0.05
"""Greatest [m/s]."""
TURN = 0.2
"""Greatest [rad/s]."""
AT_START = 0.02
"""Distance from the start up to which an arm counts as there [m]."""
TURNED = 0.1
"""The same for its orientation [rad]."""
PACES = (1.0, 0.5, 0.25, 0.1)
"""Shares of these speeds that are tried, where a cell's limits are lower."""
TOO_FAST = ("speed", "acceleration", "jerk", "joint_speed")
"""Rules that a slower way may keep."""
AGREEMENT = 30.0
"""In which a person may arm again to agree [s]."""


class Approach:
    """Arming an arm that is not at the start takes a second word from the person."""

    def __init__(self) -> None:
        self.wanted = False
        """Whether the arms go to the start as soon as they are ready."""
        self.running = False
        """Whether they are on their way."""
        self._agreement_ends = 0

    def refusal(
        self, away: Sequence[str], grips: Sequence[Pose], starts: Sequence[Pose], now: int
    ) -> str:
        """Why the arms are not armed yet, in words; empty when nothing is in the way.

        Args:
            away: Names of the arms that are not at the start.
            grips: Where these are.
            starts: Where they shall be.
        """
        agreed = now <= self._agreement_ends
        self._agreement_ends = 0
        self.wanted = bool(away)
        if not away or agreed:
            return ""
        self._agreement_ends = now + round(AGREEMENT / NANOSECONDS)
        words = []
        for name, grip, start in zip(away, grips, starts, strict=True):
            far, turn = distance(grip, start)
            words.append(f"{name} is {1e3 * far:.0f} mm and {turn:.2f} rad from the start")
        return (
            f"{', '.join(words)}; arm again within {AGREEMENT:.0f} s to let it go there straight "
            f"at most at {1e3 * SPEED:.0f} mm/s, or jog it there first"
        )


def distance(a: Pose, b: Pose) -> tuple[float, float]:
    """Between two grips [m, rad]."""
    turn = poses.logarithm(poses.multiply(b.orientation, poses.conjugate(a.orientation)))
    return float(np.linalg.norm(b.position - a.position)), float(np.linalg.norm(turn))


def is_away(grip: Pose, start: Pose) -> bool:
    """Whether an arm is not at its start."""
    far, turn = distance(grip, start)
    return far > AT_START or turn > TURNED


def slow_chunk(
    grips: Sequence[Pose], goals: Sequence[Pose], now: int, pace: float = 1.0
) -> SetpointChunk:
    """Straight from some grips to others, all arriving together, at rest at both ends.

    Args:
        pace: Share of the greatest speeds.
    """
    ways = [distance(a, b) for a, b in zip(grips, goals, strict=True)]
    # The middle of the quintic is 15/8 times as fast as its mean.
    duration = max([1.0, *(1.875 * max(far / SPEED, turn / TURN) for far, turn in ways)]) / pace
    dt = max(0.02, duration / 1500.0)
    u = np.clip(np.arange(int(np.ceil(duration / dt)) + 3) * dt / duration, 0.0, 1.0)
    share = 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5
    pairs = list(zip(grips, goals, strict=True))
    positions = [[a.position + s * (b.position - a.position) for a, b in pairs] for s in share]
    turns = [[poses.slerp(a.orientation, b.orientation, s) for a, b in pairs] for s in share]
    return SetpointChunk(now, dt, np.array(positions), np.array(turns))

"""The slow way of an arm from where it is to the scenario's start."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from services.robot_gateway.trajectory import Chunk
from shared.geometry import poses
from shared.geometry.poses import Pose

SPEED = 0.05
"""Greatest [m/s]."""
TURN = 0.2
"""Greatest [rad/s]."""
SESSION = "approach"
AT_START = 0.02
"""Distance from the start up to which an arm counts as there [m]."""
TURNED = 0.1
"""The same for its orientation [rad]."""


def distance(a: Pose, b: Pose) -> tuple[float, float]:
    """Between two grips [m, rad]."""
    turn = poses.logarithm(poses.multiply(b.orientation, poses.conjugate(a.orientation)))
    return float(np.linalg.norm(b.position - a.position)), float(np.linalg.norm(turn))


def is_away(grip: Pose, start: Pose) -> bool:
    """Whether an arm is not at its start."""
    far, turn = distance(grip, start)
    return far > AT_START or turn > TURNED


def slow_chunk(grips: Sequence[Pose], goals: Sequence[Pose], now: int) -> Chunk:
    """Straight from some grips to others, all arriving together, at rest at both ends."""
    ways = [distance(a, b) for a, b in zip(grips, goals, strict=True)]
    # The middle of the quintic is 15/8 times as fast as its mean.
    duration = max([1.0, *(1.875 * max(far / SPEED, turn / TURN) for far, turn in ways)])
    dt = max(0.02, duration / 1500.0)
    u = np.clip(np.arange(int(np.ceil(duration / dt)) + 3) * dt / duration, 0.0, 1.0)
    share = 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5
    pairs = list(zip(grips, goals, strict=True))
    positions = [[a.position + s * (b.position - a.position) for a, b in pairs] for s in share]
    turns = [[poses.slerp(a.orientation, b.orientation, s) for a, b in pairs] for s in share]
    return Chunk(SESSION, 0, now, dt, np.array(positions), np.array(turns))

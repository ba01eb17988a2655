"""Ways of grips, looked at so densely that nothing slips through between two poses."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.trajectory import Stop

DENSE = 0.008
"""Farthest that a gripper moves between two poses that are judged [m]: a body of 17 mm with what it
keeps out dips no more than 0.5 mm between them."""
ARM = 0.1
"""Farthest that a gripper's body reaches from its grip, for what a turn moves [m]."""
LEAST = 8
"""Poses of every stop that are judged, however short it is."""
MOST = 400
"""Poses at the most: a stop from 2 m/s needs half of them."""


def densely(
    positions: Float64[np.ndarray, "m n 3"], orientations: Float64[np.ndarray, "m n 4"]
) -> tuple[Float64[np.ndarray, "k n 3"], Float64[np.ndarray, "k n 4"]]:
    """The same way with poses between those that are far apart, the given ones among them."""
    if len(positions) < 2:
        return positions, orientations
    way = np.diff(positions, axis=0)
    turn = poses.logarithm(poses.multiply(orientations[1:], poses.conjugate(orientations[:-1])))
    moved = np.linalg.norm(way, axis=-1) + ARM * np.linalg.norm(turn, axis=-1)
    parts = np.ceil(np.max(moved, axis=1, initial=0.0) / DENSE).astype(int)
    if np.max(parts) <= 1:
        return positions, orientations
    parts = np.maximum(parts, 1)
    gap = np.repeat(np.arange(len(parts)), parts)
    share = np.concatenate([np.arange(1, count + 1) / count for count in parts])[:, None, None]
    between = positions[gap] + share * way[gap]
    turned = poses.multiply(poses.exponential(share * turn[gap]), orientations[gap])
    return (
        np.concatenate([positions[:1], between]),
        np.concatenate([orientations[:1], turned]),
    )


def stop_times(stop: Stop) -> Float64[np.ndarray, "m 1 1 1"]:
    """When a stop is judged, from its beginning to its end [s]."""
    # While the acceleration is taken away the speed may still grow a little.
    eased = stop.twists + stop.accelerations * stop.durations[0] / 2.0
    speeds = np.maximum(np.linalg.norm(stop.twists, axis=-1), np.linalg.norm(eased, axis=-1))
    fastest = float(np.max(speeds @ np.array([1.0, ARM]), initial=0.0))
    count = int(np.clip(np.ceil(fastest * stop.duration / DENSE) + 1, LEAST, MOST))
    return np.linspace(0.0, stop.duration, count)[:, None, None, None]

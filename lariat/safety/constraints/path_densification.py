"""Densification of paths, so that no obstacle fits between two checked poses."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.trajectory import Stop

MAX_POSE_SPACING = 0.008
"""Longest motion of a gripper between two checked poses [m]. A body of 17 mm, margin included, dips
at most 0.5 mm between them."""
GRIPPER_LEVER_ARM = 0.1
"""Farthest point of a gripper's body from its grip, for the motion that a rotation causes [m]."""
LEAST_STOP_POSES = 8
"""Number of checked poses of the shortest stop."""
MOST_STOP_POSES = 400
"""Number of checked poses of the longest stop; one from 2 m/s needs half of them."""


def densified(
    positions: Float64[np.ndarray, "m n 3"], orientations: Float64[np.ndarray, "m n 4"]
) -> tuple[Float64[np.ndarray, "k n 3"], Float64[np.ndarray, "k n 4"]]:
    """Return the same path with poses inserted between those that are far apart.

    Args:
        positions: Positions of n grippers along the path [m].
        orientations: Their orientations, wxyz.

    Returns:
        Positions and orientations; all given poses are among them.
    """
    if len(positions) < 2:
        return positions, orientations
    steps = positions[1:] - positions[:-1]
    turns = poses.logarithm(poses.multiply(orientations[1:], poses.conjugate(orientations[:-1])))
    moved = np.sqrt(np.add.reduce(steps * steps, axis=-1))
    moved += GRIPPER_LEVER_ARM * np.sqrt(np.add.reduce(turns * turns, axis=-1))
    parts = np.ceil(moved.max(axis=1, initial=0.0) / MAX_POSE_SPACING).astype(int)
    if parts.max() <= 1:
        return positions, orientations
    parts = np.maximum(parts, 1)
    segment = np.repeat(np.arange(len(parts)), parts)
    share = np.concatenate([np.arange(1, count + 1) / count for count in parts])[:, None, None]
    between = positions[segment] + share * steps[segment]
    turned = poses.multiply(poses.exponential(share * turns[segment]), orientations[segment])
    return (
        np.concatenate([positions[:1], between]),
        np.concatenate([orientations[:1], turned]),
    )


def stop_times(stop: Stop) -> Float64[np.ndarray, "m 1 1 1"]:
    """Return the times at which a stop is checked, from its beginning to its end [s]."""
    # While the acceleration is removed the speed may still grow a little.
    eased = stop.twists + stop.accelerations * stop.durations[0] / 2.0
    speeds = np.maximum(np.linalg.norm(stop.twists, axis=-1), np.linalg.norm(eased, axis=-1))
    fastest = float(np.max(speeds @ np.array([1.0, GRIPPER_LEVER_ARM]), initial=0.0))
    count = np.ceil(fastest * stop.duration / MAX_POSE_SPACING) + 1
    count = int(np.clip(count, LEAST_STOP_POSES, MOST_STOP_POSES))
    return np.linspace(0.0, stop.duration, count)[:, None, None, None]

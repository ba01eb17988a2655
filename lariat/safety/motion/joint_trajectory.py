"""Trajectories of the joints as setpoints of the grips.

Between its points a trajectory is a cubic of each joint. Points without velocities get those of
their neighbours' chord, and rest at both ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import JointConstraints, Path
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.validation import ChunkRefused
from lariat.trajectory import NANOSECONDS, SetpointChunk, Spline

START_TOLERANCE = 0.02
"""Most angle between a joint and the first point of its trajectory [rad]."""
BRANCH_TOLERANCE = 0.01
"""Most angle between a joint of the trajectory and the one that the grip's pose gives [rad]."""
LONGEST_TRAJECTORY = 60.0
"""Most time of a trajectory [s]."""
LEAD = 0.1
"""Time from the check of a trajectory to its beginning [s]."""
DT = 0.02
"""Time between two setpoints [s]."""
RESTING_POSES = 13
"""Number of setpoints at the end: the shortest trajectory has the length of a chunk."""


@dataclass(frozen=True)
class JointPoints:
    """Points of one arm's joints."""

    positions: Float64[np.ndarray, "k j"]
    """Angles at each time [rad]."""
    velocities: Float64[np.ndarray, "k j"] | None = None
    """Speeds at each time [rad/s]; None where the trajectory has none."""


def check_trajectory(
    follower: SetpointFollower,
    joints: Sequence[JointConstraints | None],
    arms: Sequence[JointPoints | None],
    times: Float64[np.ndarray, "k"],
    now: int,
) -> Spline:
    """Return the curve of a trajectory that may be followed, soon after the present.

    Args:
        follower: Commanded motion, at rest.
        joints: Joint constraints of each driven end.
        arms: Points of each driven end; None where it stands still.
        times: Time of each point from the beginning, increasing [s].
        now: Present time [ns].

    Raises:
        ChunkRefused: It breaks a rule, which the exception names.
    """
    if times[-1] > LONGEST_TRAJECTORY:
        raise ChunkRefused(
            "finite", f"it takes {times[-1]:.1f} s, more than {LONGEST_TRAJECTORY} s"
        )
    count = int(np.ceil(times[-1] / DT - 1e-9)) + 1
    at = np.append(np.minimum(np.arange(count) * DT, times[-1]), np.full(RESTING_POSES, times[-1]))
    state = follower.state
    shape = (len(at), len(follower.driven))
    positions, orientations = np.zeros((*shape, 3)), np.zeros((*shape, 4))
    for k, arm in enumerate(arms):
        if arm is None:
            positions[:, k], orientations[:, k] = state.positions[k], state.orientations[k]
            continue
        constraints = joints[k]
        if constraints is None or constraints.joints is None:
            raise ChunkRefused("lost_link", "the arm's joints are not known")
        path = _sampled(arm, times, constraints.joints, at)
        grips = [constraints.kinematics.grip(row) for row in path]
        positions[:, k] = [grip.position for grip in grips]
        orientations[:, k] = [grip.orientation for grip in grips]
        _check_branch(constraints, path, grips)
    chunk = SetpointChunk(now + int(LEAD / NANOSECONDS), DT, positions, orientations)
    with follower.constraints.rope_length.finishing_searches():
        return follower.check(chunk, now)


def _sampled(
    arm: JointPoints,
    times: Float64[np.ndarray, "k"],
    present: Float64[np.ndarray, "j"],
    at: Float64[np.ndarray, "m"],
) -> Path:
    """Joints at some times [s]; one that begins later begins at the present ones."""
    points, speeds = arm.positions, arm.velocities
    if points.shape[1:] != present.shape:
        raise ChunkRefused("finite", f"{points.shape[1]} joints, the arm has {len(present)}")
    if times[0] > 0.0:
        times, points = np.append(0.0, times), np.vstack([present, points])
        speeds = None if speeds is None else np.vstack([0.0 * present, speeds])
    jump = float(np.abs(points[0] - present).max())
    if jump > START_TOLERANCE:
        raise ChunkRefused("step", f"it begins {jump:.3f} rad from the arm's joints")
    if speeds is None:
        speeds = np.zeros_like(points)
        speeds[1:-1] = (points[2:] - points[:-2]) / (times[2:] - times[:-2])[:, None]
    if np.any(speeds[[0, -1]]):
        raise ChunkRefused("rest", "it does not begin and end at rest")
    k = np.clip(np.searchsorted(times, at, side="right") - 1, 0, max(len(times) - 2, 0))
    if len(times) == 1:
        return np.repeat(points, len(at), axis=0)
    h = (times[k + 1] - times[k])[:, None]
    u = (at - times[k])[:, None] / h
    a, b, v, w = points[k], points[k + 1], h * speeds[k], h * speeds[k + 1]
    return a + u * (v + u * (3.0 * (b - a) - 2.0 * v - w + u * (2.0 * (a - b) + v + w)))


def _check_branch(constraints: JointConstraints, path: Path, grips: Sequence[Pose]) -> None:
    """Check that the joints are those which the arm takes for the poses of its grip.

    Raises:
        ChunkRefused: They are others, or the arm is singular there.
    """
    assert constraints.joints is not None
    positions = np.array([grip.position for grip in grips])
    orientations = np.array([grip.orientation for grip in grips])
    taken = constraints.kinematics.follow(positions, orientations, constraints.joints)
    if taken is None or np.abs(taken[1:] - path).max() > BRANCH_TOLERANCE:
        words = "its joints are not those that the arm takes for the same poses of its gripper"
        raise ChunkRefused("singularity", words)

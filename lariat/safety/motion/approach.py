"""Approach: slow motion of the arms to the scenario's start, while a person consents to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from lariat.geometry import poses
from lariat.geometry.poses import Pose, pose_difference
from lariat.safety.constraints.rule import Rule
from lariat.safety.motion.follower import SetpointFollower
from lariat.safety.motion.validation import ChunkRefused
from lariat.trajectory import SetpointChunk, Spline

APPROACH_PACES = (1.0, 0.5, 0.25, 0.1)
"""Fractions of the approach speeds that are tried in turn where a cell's limits are lower [-]."""
PACE_RULES: tuple[Rule, ...] = (
    "speed",
    "acceleration",
    "jerk",
    "joint_speed",
    "joint_acceleration",
)
"""Rules that a slower approach may keep."""
PEAK_OVER_MEAN_SPEED = 1.875
"""Greatest speed of the quintic from rest to rest over its mean speed [-]."""


@dataclass(frozen=True)
class ApproachSettings:
    """Settings of the approach."""

    speed: float = 0.05
    """Greatest speed of a grip [m/s]."""
    angular_speed: float = 0.2
    """Greatest angular speed of a grip [rad/s]."""
    start_distance: float = 0.02
    """Distance from the start up to which an arm counts as there [m]."""
    start_angle: float = 0.1
    """Angle from the start up to which an arm counts as there [rad]."""
    distance_tolerance: float = 0.005
    """Most difference between the distance that a person named and the present one [m]."""
    angle_tolerance: float = 0.02
    """Most difference between the angle that a person named and the present one [rad]."""
    least_duration: float = 1.0
    """Least duration of an approach [s]."""
    dt: float = 0.02
    """Least time between two setpoints [s]."""
    max_intervals: float = 1500.0
    """Most setpoint intervals, for long approaches."""


SETTINGS = ApproachSettings()
"""Settings that every cell uses."""


def is_away(grip: Pose, start: Pose) -> bool:
    """Return whether an arm is not at its start."""
    distance, angle = pose_difference(grip, start)
    return distance > SETTINGS.start_distance or angle > SETTINGS.start_angle


def is_as_named(named: tuple[float, float], present: tuple[float, float]) -> bool:
    """Return whether distance and angle that a person named are the present ones [m, rad]."""
    distance, angle = np.abs(np.subtract(named, present))
    return bool(distance <= SETTINGS.distance_tolerance and angle <= SETTINGS.angle_tolerance)


def plan_approach(
    follower: SetpointFollower, grips: Sequence[Pose], goals: Sequence[Pose], now: int
) -> Spline:
    """Return the fastest approach of the driven ends that keeps every rule.

    Args:
        follower: Commanded motion, at rest at the grips.
        grips: Present poses.
        goals: Poses at the end.
        now: Time of the first setpoint [ns].

    Raises:
        ChunkRefused: No pace keeps every rule.
    """
    *faster, slowest = APPROACH_PACES
    with follower.constraints.rope_length.finishing_searches():
        for pace in faster:
            try:
                return follower.check(approach_chunk(grips, goals, now, pace), now)
            except ChunkRefused as refused:
                if refused.rule not in PACE_RULES:
                    raise
        return follower.check(approach_chunk(grips, goals, now, slowest), now)


def approach_chunk(
    grips: Sequence[Pose], goals: Sequence[Pose], now: int, pace: float = 1.0
) -> SetpointChunk:
    """Return straight motion between poses, at rest at both ends; all grips arrive together.

    Args:
        grips: Present poses.
        goals: Poses at the end.
        now: Time of the first setpoint [ns].
        pace: Fraction of the greatest speeds [-].
    """
    differences = [pose_difference(a, b) for a, b in zip(grips, goals, strict=True)]
    slowest = (
        PEAK_OVER_MEAN_SPEED * max(distance / SETTINGS.speed, angle / SETTINGS.angular_speed)
        for distance, angle in differences
    )
    duration = max([SETTINGS.least_duration, *slowest]) / pace
    dt = max(SETTINGS.dt, duration / SETTINGS.max_intervals)
    u = np.clip(np.arange(int(np.ceil(duration / dt)) + 3) * dt / duration, 0.0, 1.0)
    share = 10.0 * u**3 - 15.0 * u**4 + 6.0 * u**5
    pairs = list(zip(grips, goals, strict=True))
    positions = [[a.position + s * (b.position - a.position) for a, b in pairs] for s in share]
    turns = [[poses.slerp(a.orientation, b.orientation, s) for a, b in pairs] for s in share]
    return SetpointChunk(now, dt, np.array(positions), np.array(turns))

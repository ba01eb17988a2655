"""Setpoint validation: a chunk that breaks a rule is refused whole, with the rule's name."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lariat.geometry.poses import angle_between
from lariat.safety.constraints.rule import Rule
from lariat.safety.motion_contract import LEAST_CHUNK_SPAN
from lariat.trajectory import NANOSECONDS, MotionLimits, MotionState, SetpointChunk, Spline


@dataclass(frozen=True)
class ChunkTolerances:
    """Tolerances for a chunk; the commanded motion keeps the limits whatever the chunk says."""

    span: float = LEAST_CHUNK_SPAN
    """Least time from the first pose to the last [s]."""
    age: float = 0.25
    """Most time between the first pose and the present, either way [s]."""
    dt: tuple[float, float] = (0.002, 0.2)
    """Least and most time between two poses [s]."""
    poses: int = 40
    """Most poses of a writer's chunk; a controller's has up to 30."""
    longest_span: float = 2.0
    """Most time from the first pose of a writer's chunk to its last [s]. Poses and span bound the
    time that its check takes of a tick."""
    coordinate: float = 1e3
    """Largest coordinate of a position [m]."""
    quaternion_norm: float = 1e-3
    """Most deviation of a quaternion's norm from one [-]."""
    speed: float = 1.02
    """Most speed as a fraction of the limit [-]."""
    acceleration: float = 1.5
    """Most acceleration as a fraction of the limit [-]; what exceeds the limit is smoothed."""
    jerk: float = 10.0
    """Most jerk as a fraction of the limit [-]: a planner that bounds the acceleration alone
    reverses it within one dt."""
    step: float = 0.03
    """Most distance from the commanded position at the time of taking over [m]."""
    turn: float = 0.2
    """Most angle from the commanded orientation at the time of taking over [rad]."""


class ChunkRefused(ValueError):
    """A chunk that is not followed."""

    def __init__(self, rule: Rule, reason: str) -> None:
        super().__init__(f"{rule}: {reason}")
        self.rule: Rule = rule


def check_length(chunk: SetpointChunk, tolerances: ChunkTolerances) -> None:
    """Check that a writer's chunk is short enough to be checked within a tick.

    Args:
        chunk: Setpoints.
        tolerances: Tolerances for chunks.

    Raises:
        ChunkRefused: By rule `finite`.
    """
    count = len(chunk.positions)
    if count > tolerances.poses or chunk.span > tolerances.longest_span:
        raise ChunkRefused(
            "finite",
            f"{count} poses over {chunk.span:.2f} s; a chunk has up to {tolerances.poses} poses "
            f"and {tolerances.longest_span:g} s",
        )


def check_finite(chunk: SetpointChunk, ends: int, tolerances: ChunkTolerances) -> None:
    """Check that numbers are finite, shapes fit, and quaternions are rotations.

    Args:
        chunk: Setpoints.
        ends: Number of ends that they must drive.
        tolerances: Tolerances for chunks.

    Raises:
        ChunkRefused: By rule `finite`.
    """
    k = len(chunk.positions)
    shapes = (chunk.positions.shape, chunk.orientations.shape)
    if shapes != ((k, ends, 3), (k, ends, 4)) or k < 2:
        raise ChunkRefused("finite", f"poses of shapes {shapes} do not fit {ends} driven ends")
    if not (np.isfinite(chunk.positions).all() and np.isfinite(chunk.orientations).all()):
        raise ChunkRefused("finite", "a pose holds a number that is not finite")
    if (farthest := np.abs(chunk.positions).max()) > tolerances.coordinate:
        raise ChunkRefused("finite", f"a position of {farthest:g} m")
    norms = np.linalg.norm(chunk.orientations, axis=-1)
    if np.abs(norms - 1.0).max() > tolerances.quaternion_norm:
        worst = norms.flat[np.argmax(abs(norms - 1))]
        raise ChunkRefused("finite", f"a quaternion of norm {worst:g}")
    low, high = tolerances.dt
    if not low <= chunk.dt <= high:
        raise ChunkRefused("finite", f"dt = {chunk.dt:g} s is not within {low:g}…{high:g} s")


def check_fresh(chunk: SetpointChunk, now: int, offset: int, tolerances: ChunkTolerances) -> None:
    """Check that a chunk begins near the present, and is long enough.

    Args:
        chunk: Setpoints.
        now: Present time [ns].
        offset: Offset from the clock of the writer to that of the gateway [ns].
        tolerances: Tolerances for chunks.

    Raises:
        ChunkRefused: By rule `fresh` or `rest`.
    """
    age = (now - chunk.start - offset) * NANOSECONDS
    if abs(age) > tolerances.age:
        word = "old" if age > 0.0 else "early"
        raise ChunkRefused("fresh", f"its first pose is {abs(age):.3f} s too {word}")
    # One dt of grace, for writers that count poses instead of intervals.
    if chunk.span + chunk.dt < tolerances.span:
        raise ChunkRefused("rest", f"spans {chunk.span:.3f} s, less than {tolerances.span} s")


def check_limits(
    spline: Spline, now: int, limits: MotionLimits, tolerances: ChunkTolerances
) -> None:
    """Check speed, acceleration and jerk of the rest of a chunk, and that it ends at rest.

    Args:
        spline: Curve of the chunk.
        now: Present time [ns].
        limits: Limits on the motion of each gripper.
        tolerances: Tolerances for chunks.

    Raises:
        ChunkRefused: By rule `rest`, `speed`, `acceleration` or `jerk`.
    """
    past = max(int((now - spline.start) * NANOSECONDS / spline.dt) - 1, 0)
    speeds, last = spline.differences(1), spline.count - 1
    table: tuple[tuple[Rule, np.ndarray, np.ndarray, float, tuple[str, str]], ...] = (
        ("speed", speeds, limits.speed_bounds, tolerances.speed, ("m/s", "rad/s")),
        (
            "acceleration",
            spline.differences(2),
            limits.acceleration_bounds,
            tolerances.acceleration,
            ("m/s²", "rad/s²"),
        ),
        ("jerk", spline.differences(3), limits.jerk_bounds, tolerances.jerk, ("m/s³", "rad/s³")),
    )
    stopping = speeds[last - 1] / spline.dt
    if np.any(stopping > tolerances.acceleration * limits.acceleration_bounds[..., 0]):
        worst = float(np.max(stopping * spline.dt))
        raise ChunkRefused("rest", f"does not end at rest: its last poses move at {worst:.3f} m/s")
    for rule, differences, limit, factor, units in table:
        rest = differences[past:]
        excess = rest / (factor * limit[..., 0])
        if excess.max(initial=0.0) > 1.0 + 1e-9:
            _, end, kind = np.unravel_index(int(np.argmax(excess)), excess.shape)
            worst = float(np.max(rest[:, end, kind]))
            raise ChunkRefused(
                rule,
                f"asks for {worst:.3f} {units[kind]}; "
                f"the limit is {float(limit[kind, 0]):.3f} {units[kind]}",
            )


def check_step(spline: Spline, now: int, state: MotionState, tolerances: ChunkTolerances) -> None:
    """Check that the chunk takes over near the command.

    Args:
        spline: Curve of the chunk.
        now: Time of taking over [ns].
        state: Command at that time.
        tolerances: Tolerances for chunks.

    Raises:
        ChunkRefused: By rule `step`.
    """
    distance, angle = gap(state, spline(now))
    if distance > tolerances.step:
        raise ChunkRefused("step", f"jumps by {1e3 * distance:.1f} mm from the commanded position")
    if angle > tolerances.turn:
        raise ChunkRefused("step", f"jumps by {angle:.3f} rad from the commanded orientation")


def gap(state: MotionState, target: MotionState) -> tuple[float, float]:
    """Return distance and angle between two states, of the farthest end each [m, rad]."""
    ends = zip(state.positions.tolist(), target.positions.tolist(), strict=True)
    turns = zip(state.orientations.tolist(), target.orientations.tolist(), strict=True)
    distance = max((math.dist(a, b) for a, b in ends), default=0.0)
    return distance, max((angle_between(a, b) for a, b in turns), default=0.0)

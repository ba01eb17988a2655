"""Check of a chunk against the rules of motion and of the cell."""

from __future__ import annotations

import numpy as np

from lariat.safety.constraints.path_check import PathCheck
from lariat.safety.constraints.rule import Rule
from lariat.safety.motion import validation
from lariat.safety.motion.validation import ChunkRefused, ChunkTolerances
from lariat.trajectory import NANOSECONDS, MotionLimits, MotionState, SetpointChunk, Spline

EXCESS_UNITS: dict[Rule, str] = {
    "joint_limits": "rad",
    "joint_speed": "rad/s",
    "joint_acceleration": "rad/s²",
    "singularity": "m/rad",
}
"""Units of the amount by which a rule is broken, where it is not metres."""

UNKNOWN_LENGTH = "no path of the permitted length between the grips is known yet"
"""Reason where the shortest path round the obstacles is not known yet, which counts as too long."""


def check_rules(
    chunk: SetpointChunk,
    spline: Spline,
    now: int,
    state: MotionState,
    paths: PathCheck,
    limits: MotionLimits,
    tolerances: ChunkTolerances,
) -> None:
    """Check the rest of a chunk: speeds, grips and grippers, then joints and bodies of the arms.

    Args:
        chunk: Setpoints of the driven ends, whose numbers are finite.
        spline: Their curve.
        now: Present time [ns].
        state: Present command.
        paths: Constraints of the cell.
        limits: Limits on the motion of each gripper.
        tolerances: Tolerances for chunks.

    Raises:
        ChunkRefused: The chunk breaks a rule, which the exception names.
    """
    validation.check_limits(spline, now, limits, tolerances)
    past = int((now - spline.start) * NANOSECONDS / spline.dt)
    rest = slice(min(max(past, 0), spline.count - 1), None)
    positions, orientations = chunk.positions[rest], chunk.orientations[rest]
    _refuse(paths.chunk_broken_by_grippers(state, positions, orientations))
    _refuse(paths.chunk_broken_by_arms(state, positions, orientations, chunk.dt))


def _refuse(breach: tuple[Rule, float] | None) -> None:
    if breach:
        rule, excess = breach
        if rule == "overstretch" and not np.isfinite(excess):
            raise ChunkRefused(rule, UNKNOWN_LENGTH)
        raise ChunkRefused(rule, f"broken by {excess:.4f} {EXCESS_UNITS.get(rule, 'm')}")

"""Check of a chunk against every rule, in pieces of bounded work.

A tick checks one piece beside everything else that it does, so that the longest chunk takes no more
of a tick than a part of its check. The pieces are counted, not timed: simulation and replay do the
same.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from lariat.trajectory import NANOSECONDS, MotionLimits, MotionState, SetpointChunk, Spline
from services.robot_gateway.motion import validation
from services.robot_gateway.motion.validation import ChunkRefused, ChunkTolerances
from shared.constraints.path_check import PathCheck
from shared.constraints.rule import Rule

EXCESS_UNITS: dict[Rule, str] = {
    "joint_limits": "rad",
    "joint_speed": "rad/s",
    "singularity": "m/rad",
}
"""Units of the amount by which a rule is broken, where it is not metres."""

UNKNOWN_LENGTH = "no path of the permitted length between the grips is known yet"
"""Reason where the shortest path round the obstacles is not known yet, which counts as too long."""


class ChunkCheck:
    """Check of one chunk: first its motion and the grippers, then joints and bodies of the arms.

    Without joints the second piece is short, and joined to the first one. If the scene changes in
    between, the grippers are checked anew against the obstacles that are new or have moved; joints
    and bodies of the arms are checked in the scene of the last piece anyway.
    """

    def __init__(
        self,
        chunk: SetpointChunk,
        offset: int,
        paths: PathCheck,
        limits: MotionLimits,
        tolerances: ChunkTolerances,
        curve: Callable[[SetpointChunk, int], Spline] = Spline,
    ) -> None:
        """Create the check of a chunk whose numbers are finite.

        Args:
            chunk: Setpoints of the driven ends.
            offset: Offset from the clock of the writer to that of the gateway [ns].
            paths: Constraints of the cell.
            limits: Limits on the motion of each gripper.
            tolerances: Tolerances for chunks.
            curve: Creates the curve of a chunk that begins at a time [ns].
        """
        self.chunk = chunk
        self.offset = offset
        self._paths = paths
        self._limits = limits
        self._tolerances = tolerances
        self._curve = curve
        self._obstacles = paths.constraints.obstacles
        self._first: int | None = None
        """Index of the first pose that is checked; None before the first piece."""

    @cached_property
    def spline(self) -> Spline:
        """Curve of the chunk."""
        return self._curve(self.chunk, self.chunk.start + self.offset)

    def advance(self, now: int, state: MotionState, taking_over: int) -> bool:
        """Check the next piece, and return whether the chunk keeps every rule.

        Args:
            now: Present time [ns].
            state: Present command.
            taking_over: Time at which the chunk would take over from the command [ns].

        Raises:
            ChunkRefused: The chunk breaks a rule, which the exception names.
        """
        obstacles = self._paths.constraints.obstacles
        begun = self._first is not None
        if self._first is None:
            self._first = self._check_grippers(now, state)
            self._obstacles = obstacles
        if self._paths.joint_constraints and not begun:
            return False
        rest = slice(self._first, None)
        positions, orientations = self.chunk.positions[rest], self.chunk.orientations[rest]
        if obstacles is not self._obstacles:
            former = set(self._obstacles)
            new = [obstacle for obstacle in obstacles if obstacle not in former]
            if new:
                _refuse(self._paths.chunk_broken_near_bodies(new, state, positions, orientations))
            self._obstacles = obstacles
        _refuse(self._paths.chunk_broken_by_arms(state, positions, orientations, self.chunk.dt))
        validation.check_fresh(self.chunk, now, self.offset, self._tolerances)
        validation.check_step(self.spline, taking_over, state, self._tolerances)
        return True

    def _check_grippers(self, now: int, state: MotionState) -> int:
        """Check motion and grippers from the present on; return the index of the first pose."""
        spline = self.spline
        validation.check_limits(spline, now, self._limits, self._tolerances)
        past = int((now - spline.start) * NANOSECONDS / spline.dt)
        first = min(max(past, 0), spline.count - 1)
        positions, orientations = self.chunk.positions[first:], self.chunk.orientations[first:]
        _refuse(self._paths.chunk_broken_by_grippers(state, positions, orientations))
        return first


def _refuse(found: tuple[Rule, float] | None) -> None:
    if found:
        rule, excess = found
        if rule == "overstretch" and not np.isfinite(excess):
            raise ChunkRefused(rule, UNKNOWN_LENGTH)
        raise ChunkRefused(rule, f"broken by {excess:.4f} {EXCESS_UNITS.get(rule, 'm')}")

"""Setpoint follower: generates the commanded motion of a cell from chunks, within every rule.

It computes the commanded poses; `safety` decides whether the arms may move.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from lariat.safety.constraints.joints import JointConstraints
from lariat.safety.constraints.motion_constraints import CellBoundaries, MotionConstraints
from lariat.safety.constraints.path_check import PathCheck
from lariat.safety.constraints.rule import Rule
from lariat.safety.motion import motion_kernels, validation
from lariat.safety.motion.chunk_check import check_rules
from lariat.safety.motion.reference_tracking import Braking, NextCommand, ReferenceTracker
from lariat.safety.motion.validation import ChunkTolerances
from lariat.trajectory import (
    NANOSECONDS,
    Blend,
    MotionLimits,
    MotionState,
    SetpointChunk,
    Spline,
    mean_twists,
)
from lariat.trajectory.limits import norms


@dataclass(frozen=True)
class FollowerSettings:
    """Settings of the follower."""

    arrival_tolerance: tuple[float, float] = (1e-4, 3e-4)
    """Distance and angle up to which the command is where its chunk ends [m, rad]."""
    arrival_speed: float = 1e-3
    """Speed up to which the command counts as arrived [m/s, rad/s]."""
    arrival_samples: int = 8
    """Number of intervals at which the rest of a chunk is sampled for further motion."""
    min_blend_time: float = 0.06
    """Least time in which a chunk takes over from the motion before it [s]."""


class SetpointFollower:
    """Commanded poses of all ends of a cell."""

    def __init__(
        self,
        limits: MotionLimits,
        boundaries: CellBoundaries,
        starts: Sequence[Pose],
        driven: Sequence[int],
        joint_constraints: Sequence[JointConstraints | None] = (),
        tolerances: ChunkTolerances | None = None,
        settings: FollowerSettings | None = None,
    ) -> None:
        """Create a follower at rest.

        Args:
            limits: Limits on the commanded motion of each gripper.
            boundaries: Boundaries of the cell.
            starts: Grip poses of all ends.
            driven: Indices of the ends that move.
            joint_constraints: Joint constraints of each driven end, None where it has none.
            tolerances: Tolerances for chunks.
            settings: Settings of the follower.
        """
        self.tolerances = tolerances or ChunkTolerances()
        self.settings = settings or FollowerSettings()
        self.driven = list(driven)
        self.limits = limits
        self.tracker = ReferenceTracker(self.limits)
        self.paths = PathCheck(boundaries, self.driven, joint_constraints)
        self._spline: Callable[[SetpointChunk, int], Spline] = Spline
        self._blend: Callable[[Any, MotionState, int, float], Blend] = Blend
        self.stops = 0
        """Number of times that the command was halted or placed: what arrived before is void."""
        self.place(starts)

    def compile(self) -> None:
        """Follow and check by compiled code from now on."""
        if count := len(self.driven):
            kernel = motion_kernels.ReferenceKernel(count)
            self._spline = partial(motion_kernels.CompiledSpline, kernel)
            self._blend = motion_kernels.CompiledBlend
            self.tracker = motion_kernels.CompiledTracker(self.tracker, count)

    @property
    def constraints(self) -> MotionConstraints:
        """Constraints on grips and grippers."""
        return self.paths.constraints

    def place(self, grips: Sequence[Pose]) -> None:
        """Set the command to the given poses of all ends, at rest."""
        self._time: int | None = None
        self.stops += 1
        self.paths.place(grips)
        self.state = MotionState.at_rest(*(grips[k] for k in self.driven))
        self._braking = Braking(self.tracker.stop(self.state))
        self._reference: Blend | None = None

    @property
    def resting(self) -> bool:
        """Whether the command stands still."""
        return self.state.resting

    @property
    def following(self) -> bool:
        """Whether a chunk is being followed."""
        return self._reference is not None

    def arrived(self, now: int) -> bool:
        """Return whether the command is where its chunk stays.

        The rest of the chunk is sampled, because braking may have brought the command to rest
        before the chunk has even begun to move.
        """
        if self._reference is None:
            return self.resting
        left = max(self._reference.end - now, 0)
        count = self.settings.arrival_samples
        ahead = [now + left * k // count for k in range(count + 1)]
        gaps = np.array([validation.gap(self.state, self._reference(at)) for at in ahead])
        still = np.all(np.abs(self.state.twists) < self.settings.arrival_speed)
        return bool(np.all(gaps < self.settings.arrival_tolerance) and still)

    def finished(self, now: int) -> bool:
        """Return whether the resting end of the chunk has been reached."""
        return self._reference is not None and now >= self._reference.end and self.arrived(now)

    def lag(self, now: int) -> tuple[float, float]:
        """Return distance and angle from the command to its chunk, of the farthest end [m, rad]."""
        if self._reference is None or not self.driven:
            return 0.0, 0.0
        return validation.gap(self.state, self._reference(now))

    def check_receipt(self, chunk: SetpointChunk, now: int, offset: int = 0) -> None:
        """Check that a chunk is well-formed and fresh.

        Args:
            chunk: Setpoints of the driven ends.
            now: Present time [ns].
            offset: Offset from the clock of the writer to that of the gateway [ns].

        Raises:
            ChunkRefused: By rule `finite`, `fresh` or `rest`.
        """
        validation.check_finite(chunk, len(self.driven), self.tolerances)
        validation.check_fresh(chunk, now, offset, self.tolerances)

    def check(self, chunk: SetpointChunk, now: int, offset: int = 0) -> Spline:
        """Return the curve of a chunk that may be followed from now on.

        Args:
            chunk: Setpoints of the driven ends.
            now: Present time [ns].
            offset: Offset from the clock of the writer to that of the gateway [ns].

        Raises:
            ChunkRefused: The chunk breaks a rule, which the exception names.
        """
        self.check_receipt(chunk, now, offset)
        spline = self._spline(chunk, chunk.start + offset)
        check_rules(chunk, spline, now, self.state, self.paths, self.limits, self.tolerances)
        validation.check_step(spline, self._time or now, self.state, self.tolerances)
        return spline

    def follow(self, spline: Spline, now: int) -> None:
        """Take over from the present motion to a checked curve."""
        # The motion is known at the last tick, not when a message happens to arrive.
        now = self._time or now
        target = spline(now)
        gap = mean_twists(target, self.state, 1.0)
        slip = self.state.twists - target.twists
        limit = self.limits.acceleration_bounds
        # A quintic offset of size d takes accelerations of up to 5.8 d / T^2, half of the limit.
        # Beyond the limit the command would overshoot, from where the next chunk takes over.
        durations = np.maximum(np.sqrt(11.5 * norms(gap) / limit), 4.0 * norms(slip) / limit)
        duration = float(durations.max(initial=self.settings.min_blend_time))
        self._reference = self._blend(spline, self.state, now, duration)

    def halt(self) -> None:
        """Begin the stop that has been checked."""
        self._reference = None
        self.stops += 1

    def finish(self) -> None:
        """Stay at the end of the chunk, which is reached."""
        self._reference = None

    def step(self, before: int, now: int, brake: bool = False) -> Rule | None:
        """Move the command from one time to another, and return the rule that slowed it, if any.

        Args:
            before: Time of the present command [ns].
            now: Time of the next one [ns].
            brake: Brake, but keep the chunk: the next one takes over from wherever that leads.
        """
        h = (now - before) * NANOSECONDS
        self._time = now
        rule = None
        if self._reference is not None and not brake:
            present = self._reference(before)
            command = self.tracker.advance(self.state, present, self._reference(now), h)
            rule = self._broken(command)
            if rule is None:
                self.state, self._braking = command.state, Braking(command.stop)
                self.paths.track(self.state)
                return None
        if not self.state.resting:
            self.state, self._braking = self._braking.step(self.state, h)
            self.paths.track(self.state)
        return rule

    def grips(self) -> list[tuple[Pose, Float64[np.ndarray, "2 3"]]]:
        """Return commanded pose and twist [m/s, rad/s] of each driven end."""
        s = self.state
        return [
            (Pose(p, q), v) for p, q, v in zip(s.positions, s.orientations, s.twists, strict=True)
        ]

    def _broken(self, command: NextCommand) -> Rule | None:
        """Return the rule that a command or the stop after it breaks."""
        if command.too_fast:
            return "speed"
        return self.paths.broken_by_stop(command.state, command.path)

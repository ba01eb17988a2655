"""Setpoint stream: the published setpoints, whose end every chunk replaces.

The points of a chunk are control points of the gateway's curve. Points that a newer chunk repeats
leave the curve unchanged. So a chunk begins with published points, up to the last decided one,
continues with new ones, and ends at rest.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Float64

from lariat.control.mpc.motion_kernels import bounds_of, kernel, rows_of
from lariat.geometry import poses
from lariat.safety.motion_contract import CHUNK_SPAN
from lariat.trajectory import (
    MotionLimits,
    MotionSequence,
    MotionState,
    SetpointChunk,
)
from lariat.trajectory.limits import norms

STOP_POINTS = 64
"""Points of a stop for which there is room; one that needs more is computed again."""
GENTLE_STOP_TIME, LEAST_JERK = 0.25, 1e-9
"""Time that even a slow motion takes to a stop at the end of its setpoints [s], and least jerk of
such a stop [m/s^3, rad/s^3]."""
OVERLAP_POINTS = 3
"""Published points that every chunk repeats before the last one that is kept."""


class SetpointStream:
    """Published setpoints, which the next chunk continues."""

    def __init__(self, motion: MotionState, now: int, dt: int, limits: MotionLimits) -> None:
        """Create a stream that begins at rest.

        Args:
            motion: Motion at rest.
            now: Present time [ns].
            dt: Time between points [ns].
            limits: Limits of the stop at the end of every chunk.
        """
        self.dt, self.limits = dt, limits
        self._origin = now - OVERLAP_POINTS * dt
        self._first = 0
        self._motions = MotionSequence.constant(motion, 1)
        self._latest: tuple[int, MotionState] | None = None
        """Time and state that were asked for last: several in turn ask for the same."""

    def index_at(self, time: int) -> int:
        """Index of the first point at or after `time` [ns]."""
        return -((self._origin - time) // self.dt)

    def time_of(self, index: int) -> int:
        """Time of a point [ns]."""
        return self._origin + index * self.dt

    def motion(self, index: int) -> MotionState:
        """Published state at a point; the stream rests before its start and after its end."""
        return self._motions[min(max(index - self._first, 0), len(self._motions) - 1)]

    def motion_at(self, time: int) -> MotionState:
        """Published state at a time [ns], extrapolated from the point before it."""
        if self._latest is None or self._latest[0] != time:
            self._latest = time, self._motion_at(time)
        return self._latest[1]

    def _motion_at(self, time: int) -> MotionState:
        index = math.floor((time - self._origin) / self.dt)
        before, after = self.motion(index), self.motion(index + 1)
        t = (time - self.time_of(index)) * 1e-9
        dt = self.dt * 1e-9
        jerk = (after.accelerations - before.accelerations) / dt
        return before.moved(
            t * (before.twists + t * (before.accelerations / 2.0 + t * jerk / 6.0)),
            before.twists + t * (before.accelerations + t * jerk / 2.0),
            before.accelerations + t * jerk,
        )

    def resting_from(self, index: int) -> bool:
        """Whether the published setpoints rest from a point on."""
        return self._motions.between(max(index - self._first, 0)).resting

    def extended(self, commit: int, motions: MotionSequence | None = None) -> SetpointChunk:
        """Chunk that continues with new motions after a point, and then stops.

        Args:
            commit: Index of the last point that is kept.
            motions: New motions, at least one; without them it stops from that point.
        """
        kept = self._kept(commit)
        if motions is None:
            return self._chunk(commit, kept, self._stop(kept[-1], bounds_of(self.limits)))
        # The end is followed where no chunk comes any more. A sharp stop would throw joints near a
        # singular pose.
        last, bounds = motions[-1], bounds_of(self.limits).copy()
        speed, rate = (norms(v).max(axis=0)[:, 0] for v in (last.twists, last.accelerations))
        jerk = 4.0 * (speed / GENTLE_STOP_TIME + rate) / GENTLE_STOP_TIME
        bounds[:, 2] = np.clip(jerk, LEAST_JERK, bounds[:, 2])
        return self._chunk(commit, kept, motions, self._stop(last, bounds))

    def continued(self, commit: int) -> SetpointChunk:
        """Chunk that goes on to the published end.

        Args:
            commit: Index of the last point that is kept.
        """
        rest = self._motions.between(max(commit + 1 - self._first, 0))
        return self._chunk(commit, self._kept(commit), rest)

    def _stop(self, state: MotionState, bounds: Float64[np.ndarray, "2 3"]) -> MotionSequence:
        """States of a stop from a state within bounds, the last one exactly at rest."""
        count, results = STOP_POINTS, np.empty(1)
        while True:
            motion = np.empty((3, count, *state.twists.shape))
            twists, accelerations = rows_of(state.twists), rows_of(state.accelerations)
            arrays = twists, accelerations, bounds, motion.reshape(-1, 3), results
            kernel("stop_grips")(*arrays, self.dt * 1e-9)
            needed = int(results[0])
            if needed <= count:
                break
            count = needed
        displacements, twists, accelerations = motion[:, :needed]
        orientations = poses.turned(displacements[:, :, 1], state.orientations)
        positions = state.positions + displacements[:, :, 0]
        return MotionSequence(positions, orientations, twists, accelerations)

    def _kept(self, commit: int) -> MotionSequence:
        """Published states that a chunk repeats, up to the last one that is kept."""
        first = commit - OVERLAP_POINTS - self._first
        if first >= 0 and commit - self._first < len(self._motions):
            return self._motions.between(first, commit + 1 - self._first)
        before = [self.motion(k) for k in range(commit - OVERLAP_POINTS, commit + 1)]
        return MotionSequence.joined(*(MotionSequence.constant(m, 1) for m in before))

    def _chunk(self, commit: int, *parts: MotionSequence) -> SetpointChunk:
        """Chunk of all points, one part after the other, which become the published ones."""
        keep_from = commit - OVERLAP_POINTS
        min_count = math.ceil(CHUNK_SPAN / (self.dt * 1e-9)) + 1
        # Two equal points at the end: the gateway's curve comes to rest between them.
        last = next(part for part in reversed(parts) if len(part))[-1]
        end = MotionState(last.positions, last.orientations, *np.zeros((2, *last.twists.shape)))
        rest = MotionSequence.constant(end, max(min_count - sum(map(len, parts)), 1))
        points = MotionSequence.joined(*parts, rest)
        self._first, self._motions, self._latest = keep_from, points, None
        return SetpointChunk(
            self.time_of(keep_from), self.dt * 1e-9, points.positions, points.orientations
        )

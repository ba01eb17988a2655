"""The row of setpoints: every chunk re-decides the end of one endless row.

The gateway reads a chunk's points as control points of a curve. Points that a newer chunk repeats
unchanged leave the curve as it was, so the first points of every chunk are those of the one before,
up to the instant from which something new may happen; and every chunk ends at rest.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from services.controller.mpc.motion import Bounds, Motion, stop

OVERLAP = 3
"""Points before the newly decided ones that every chunk repeats."""
LEAST_SPAN = 0.26
"""Of a chunk [s]."""


@dataclass(frozen=True)
class Chunk:
    """Instants `dt` apart from `t0` on; the last one is at rest."""

    t0: int
    """[ns]"""
    motions: list[Motion]


class SetpointRow:
    """Remembers what was published, so that the next chunk continues it."""

    def __init__(self, motion: Motion, now: int, dt: int, bounds: Bounds) -> None:
        """A row that begins at rest at `now`.

        Args:
            now: [ns]
            dt: Between points [ns].
            bounds: Of the stop at the end of every chunk.
        """
        self.dt, self.bounds = dt, bounds
        self._origin = now - OVERLAP * dt
        self._first = 0
        self._motions = [motion]

    def index_at(self, time: int) -> int:
        """Of the first point at or after `time` [ns]."""
        return -((self._origin - time) // self.dt)

    def time_of(self, index: int) -> int:
        """Of a point [ns]."""
        return self._origin + index * self.dt

    def motion(self, index: int) -> Motion:
        """What was published for a point; the row rests before its start and after its end."""
        return self._motions[min(max(index - self._first, 0), len(self._motions) - 1)]

    def motion_at(self, time: int) -> Motion:
        """What was published for a time [ns], between points by the state before it."""
        index = math.floor((time - self._origin) / self.dt)
        before, after = self.motion(index), self.motion(index + 1)
        t = (time - self.time_of(index)) * 1e-9
        dt = self.dt * 1e-9
        jerk = (after.acceleration - before.acceleration) / dt
        return before.moved(
            t * (before.velocity + t * (before.acceleration / 2.0 + t * jerk / 6.0)),
            before.velocity + t * (before.acceleration + t * jerk / 2.0),
            before.acceleration + t * jerk,
        )

    def resting_from(self, index: int) -> bool:
        """Whether what was published stands still from a point on."""
        return all(m.resting for m in self._motions[max(index - self._first, 0) :])

    def extended(self, commit: int, motions: Sequence[Motion]) -> Chunk:
        """The chunk that goes on with `motions` after point `commit`, and then stops.

        Without motions what was published goes on to its end.
        """
        keep_from = commit - OVERLAP
        kept = [self.motion(k) for k in range(keep_from, commit + 1)]
        if motions:
            tail = list(motions)
            tail += stop(tail[-1], self.bounds, self.dt * 1e-9)
        else:
            tail = self._motions[max(commit + 1 - self._first, 0) :]
        row = kept + tail
        least = math.ceil(LEAST_SPAN / (self.dt * 1e-9)) + 1
        # Two equal points at the end: the gateway's curve comes to rest between them.
        end = Motion(row[-1].positions, row[-1].orientations, *np.zeros((2, 2, 2, 3)))
        row += [end] * max(least - len(row), 1)
        self._first, self._motions = keep_from, row
        return Chunk(self.time_of(keep_from), row)

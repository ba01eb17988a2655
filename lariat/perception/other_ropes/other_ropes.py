"""Ropes beside the held one, followed over time.

A rope that is hidden, in part or whole, is remembered where it was, longer while something is seen
there; a place through which the camera sees is empty.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float64, Int64

from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.perception.rgbd.line_of_sight import Look

POINT_DISTANCE = 0.01
"""Distance of the points of a line [m]."""
MIN_GRIP_DISTANCE = 0.03
"""Distance of a line from the grips up to which it may be a gripper, and is no other rope [m]."""
MIN_RUN_COUNT = 3
"""Number of points below which a remembered part of a line is left out."""


@dataclass(frozen=True)
class OtherRopesSettings:
    """Distances and times by which ropes are followed."""

    max_step: float = 0.03
    """Mean distance of a line from a rope up to which it is the same rope [m]."""
    same_distance: float = 0.015
    """Distance below which a point lies on a line [m]."""
    same_share: float = 0.5
    """Share of a rope on a line from which both are one rope [-]."""
    memory: int = 1_000_000_000
    """Time for which a hidden part is remembered [ns]."""
    max_memory: int = 5_000_000_000
    """The same while something is seen at its place [ns]."""
    min_frames: int = 3
    """Number of images in which a rope is seen before it is reported."""
    averaged_frames: int = 30
    """Number of images over which the diameter is averaged."""
    min_length: float = 0.04
    """Length below which a rope is not reported [m]."""
    revised_distance: float = 0.01
    """Displacement that counts as a change [m]."""


@dataclass(frozen=True)
class SeenLine:
    """Line of a rope beside the held one, in one image."""

    points: Float64[np.ndarray, "k 3"]
    """Points of its axis, in order [m]."""
    diameter: float
    """Diameter of the rope [m]."""


@dataclass(frozen=True)
class RopePart:
    """Part of a rope, in order along it."""

    points: Float64[np.ndarray, "k 3"]
    """Points of its axis [m]."""
    seen: bool
    """Whether it lies in the newest image; otherwise it is remembered."""


@dataclass
class FollowedRope:
    """Rope beside the held one."""

    id: int
    """Number that it keeps while it is followed."""
    parts: list[RopePart] = field(default_factory=list)
    """Its parts, in no order."""
    stamps: list[Int64[np.ndarray, "k"]] = field(default_factory=list)
    """Time at which each point of each part was seen last [ns]."""
    frames: int = 0
    """Number of images in which it was seen."""
    diameter: float = 0.0
    """Mean diameter in the newest of them [m]."""

    @property
    def points(self) -> Float64[np.ndarray, "k 3"]:
        """Points of all its parts [m]."""
        return np.concatenate([part.points for part in self.parts])

    @property
    def length(self) -> float:
        """Length of all its parts [m]."""
        return sum(polylines.length(part.points) for part in self.parts)


class OtherRopes:
    """Ropes beside the held one, each by a number that it keeps."""

    def __init__(self, settings: OtherRopesSettings | None = None) -> None:
        self.settings = settings or OtherRopesSettings()
        self.revision = 1
        """Number that grows when a rope comes, goes or has moved."""
        self._ropes: list[FollowedRope] = []
        self._newest_id = 0
        self._revised: dict[int, Float64[np.ndarray, "k 3"]] = {}

    @property
    def ropes(self) -> list[FollowedRope]:
        """Ropes that were seen often enough and are long enough."""
        s = self.settings
        return [r for r in self._ropes if r.frames >= s.min_frames and r.length >= s.min_length]

    def forget(self) -> None:
        """Drop all ropes; their numbers are not given again."""
        self._ropes = []
        self._revise()

    def update(self, lines: Sequence[SeenLine], look: Look, stamp: int) -> None:
        """Take in the lines of a frame.

        Args:
            lines: Lines of the ropes in it.
            look: Function that tells what the cameras see at some points.
            stamp: Time of the exposure [ns].
        """
        lines_of: dict[int, list[SeenLine]] = {}
        for line in _distinct(lines, self.settings):
            rope = self._rope_of(line.points)
            lines_of.setdefault(rope.id, []).append(line)
        for rope in self._ropes:
            self._follow(rope, lines_of.get(rope.id, []), look, stamp)
        self._ropes = [rope for rope in self._ropes if rope.parts]
        self._revise()

    def _rope_of(self, line: Float64[np.ndarray, "k 3"]) -> FollowedRope:
        """Rope that a line belongs to; ropes that it joins become one."""
        s, joined = self.settings, []
        for rope in self._ropes:
            if not rope.parts:
                continue
            gaps = polylines.point_distances(line, rope.points)
            covered = float(np.mean(np.min(gaps, axis=0) < s.same_distance))
            if np.mean(np.min(gaps, axis=1)) < s.max_step or covered > s.same_share:
                joined.append(rope)
        if not joined:
            self._newest_id += 1
            joined = [FollowedRope(self._newest_id)]
            self._ropes.append(joined[0])
        first, *others = sorted(joined, key=lambda rope: rope.id)
        for other in others:
            first.parts += other.parts
            first.stamps += other.stamps
            first.frames = max(first.frames, other.frames)
            self._ropes.remove(other)
        return first

    def _follow(
        self,
        rope: FollowedRope,
        lines: Sequence[SeenLine],
        look: Look,
        stamp: int,
    ) -> None:
        """Replace the parts of a rope by the lines of a frame, and keep those that are hidden."""
        s = self.settings
        seen = np.concatenate([np.zeros((0, 3)), *(line.points for line in lines)])
        parts = [RopePart(line.points, seen=True) for line in lines]
        stamps = [np.full(len(line.points), stamp) for line in lines]
        for part, since in zip(rope.parts, rope.stamps, strict=True):
            sight, age = look(part.points), stamp - since
            kept = (age < np.where(sight.there, s.max_memory, s.memory)) & ~sight.past
            if len(seen):
                gaps = polylines.point_distances(part.points, seen)
                kept &= np.min(gaps, axis=1) > s.same_distance
            for run in _runs(kept):
                parts.append(RopePart(part.points[run], seen=False))
                stamps.append(since[run])
        rope.parts, rope.stamps = parts, stamps
        if lines:
            rope.frames += 1
            measured = float(
                np.average([n.diameter for n in lines], weights=[len(n.points) for n in lines])
            )
            rope.diameter += (measured - rope.diameter) / min(rope.frames, s.averaged_frames)

    def _revise(self) -> None:
        """Raise the revision where the ropes differ from those of the last one."""
        now = {rope.id: rope.points for rope in self.ropes}
        if now.keys() == self._revised.keys() and not any(
            _moved(points, self._revised[number]) > self.settings.revised_distance
            for number, points in now.items()
        ):
            return
        self._revised = now
        self.revision += 1


def is_away(points: Float64[np.ndarray, "k 3"], grips: Sequence[Pose | None]) -> bool:
    """Return whether a line is no part of a gripper.

    Args:
        points: Points of its axis [m].
        grips: Grips, None where one is unknown.
    """
    return all(
        np.min(np.linalg.norm(points - grip.position, axis=1)) > MIN_GRIP_DISTANCE
        for grip in grips
        if grip is not None
    )


def _distinct(lines: Sequence[SeenLine], s: OtherRopesSettings) -> Iterator[SeenLine]:
    """Yield evenly spaced lines, longest first, without those that lie on a longer one.

    Two cameras see one rope, and it may be found by its colour and by its depth.
    """
    taken = np.zeros((0, 3))
    for line in sorted(lines, key=lambda line: polylines.length(line.points), reverse=True):
        count = max(2, round(polylines.length(line.points) / POINT_DISTANCE) + 1)
        even = polylines.resample(line.points, count)
        if len(taken):
            gaps = polylines.least_distances(even, taken)
            if np.mean(gaps < s.same_distance) > s.same_share:
                continue
        taken = np.concatenate([taken, even])
        yield SeenLine(even, line.diameter)


def _runs(kept: Bool[np.ndarray, "k"]) -> Iterator[slice]:
    """Yield the stretches of enough points that are kept."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], kept.astype(int), [0]])))
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if stop - start >= MIN_RUN_COUNT:
            yield slice(start, stop)


def _moved(one: Float64[np.ndarray, "k 3"], other: Float64[np.ndarray, "m 3"]) -> float:
    """Largest distance of a point of either set from the other set [m]."""
    gaps = polylines.point_distances(one, other)
    return float(max(np.max(np.min(gaps, axis=0)), np.max(np.min(gaps, axis=1))))

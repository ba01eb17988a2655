"""Ropes beside the held one, followed over time.

A rope that is hidden, in part or whole, is remembered where it was, longer while something is seen
there; a place through which the camera sees is empty.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float64, Int64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.perception.centerline.foreign_strands import runs
from lariat.perception.rgbd.line_of_sight import Look

POINT_DISTANCE = 0.01
"""Distance of the points of a line [m]."""
MIN_GRIP_DISTANCE = 0.03
"""Distance of a line from the grips up to which it may be a gripper, and is no other rope [m]."""
END_MARGIN = 0.001
"""Distance past the end of a line from which a point is not on it [m]."""
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
    lines: list[tuple[Float64[np.ndarray, "k 3"], Int64[np.ndarray, "k"]]] = field(
        default_factory=list
    )
    """Points of its lines, in order along each [m], and when each was seen last [ns]."""
    stamp: int = 0
    """Time of the newest image [ns]."""
    frames: int = 0
    """Number of images in which it was seen."""
    diameter: float = 0.0
    """Mean diameter in the newest of them [m]."""

    @property
    def parts(self) -> list[RopePart]:
        """Its lines, cut where what is seen and what is remembered meet."""
        return [
            RopePart(points[max(run.start - (not seen), 0) : run.stop + (not seen)], seen)
            for points, since in self.lines
            for seen in (True, False)
            for run in runs((since == self.stamp) == seen)
        ]

    @property
    def points(self) -> Float64[np.ndarray, "k 3"]:
        """Points of all its lines [m]."""
        return np.concatenate([points for points, _ in self.lines])

    @property
    def length(self) -> float:
        """Length of all its lines [m]."""
        return sum(polylines.length(points) for points, _ in self.lines)


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
        self._ropes = [rope for rope in self._ropes if rope.lines]
        self._revise()

    def _rope_of(self, line: Float64[np.ndarray, "k 3"]) -> FollowedRope:
        """Rope that a line belongs to; ropes that it joins become one."""
        s, joined = self.settings, []
        for rope in self._ropes:
            if not rope.lines:
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
            first.lines += other.lines
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
        """Replace the lines of a rope by those of a frame, and keep what is hidden."""
        s, kept = self.settings, [(n.points, np.full(len(n.points), stamp)) for n in lines]
        for points, since in rope.lines:
            sight, age = look(points), stamp - since
            valid = (age < np.where(sight.there, s.max_memory, s.memory)) & ~sight.past
            for line in lines:
                valid &= ~_is_beside(points, line.points, s.same_distance)
            for run in runs(valid):
                _add(kept, points[run], since[run], s.same_distance)
        rope.lines, rope.stamp = kept, stamp
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


def _is_beside(
    points: Float64[np.ndarray, "k 3"], line: Float64[np.ndarray, "m 3"], distance: float
) -> Bool[np.ndarray, "k"]:
    """Whether points lie within a distance of a line, and not beyond its ends."""
    gaps = polylines.point_distances(points, line)
    nearest, beside = np.argmin(gaps, axis=1), np.min(gaps, axis=1) < distance
    for end, before in ((0, 1), (len(line) - 1, len(line) - 2)):
        outward = poses.normalized(line[end] - line[before])
        # A rope that is covered more and more is seen shorter from frame to frame.
        beside &= (nearest != end) | ((points - line[end]) @ outward < END_MARGIN)
    return beside


def _add(
    lines: list[tuple[Float64[np.ndarray, "k 3"], Int64[np.ndarray, "k"]]],
    points: Float64[np.ndarray, "m 3"],
    since: Int64[np.ndarray, "m"],
    reach: float,
) -> None:
    """Add a remembered piece: to a line that it continues, else alone if it is long enough."""
    for k, (line, seen) in enumerate(lines):
        for a, b in itertools.product((1, -1), repeat=2):
            if np.linalg.norm(line[::a][-1] - points[::b][0]) < reach:
                lines[k] = (
                    np.concatenate([line[::a], points[::b]]),
                    np.concatenate([seen[::a], since[::b]]),
                )
                return
    if len(points) >= MIN_RUN_COUNT:
        lines.append((points, since))


def _moved(one: Float64[np.ndarray, "k 3"], other: Float64[np.ndarray, "m 3"]) -> float:
    """Largest distance of a point of either set from the other set [m]."""
    gaps = polylines.point_distances(one, other)
    return float(max(np.max(np.min(gaps, axis=0)), np.max(np.min(gaps, axis=1))))

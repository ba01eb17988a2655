"""Short path round obstacles between two points, whose length bounds that of the shortest one.

The path is straight where no obstacle is in the way. Otherwise it is found by elastic bands
(Quinlan and Khatib, 1993). Each begins on one of four sides of the obstacles, is contracted and
pushed out of the obstacles in turn, and is refined from few points to many. A band that stays
outside is a path, so its length is never below the shortest one except for `MAX_PENETRATION`. When
no band stays outside, the length is infinite. A path that is known between ends nearby is a band
before all others: it leads through openings that those from the four sides miss, and takes a fifth
of the steps.

A search takes longer than a tick of the gateway, and longer the more obstacles there are: it
advances in steps, each of which handles one obstacle.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, segment_distance, signed_distance
from shared.constraints.obstacle_scene import ObstacleScene, bounding_radius

POINT_COUNTS = (5, 9, 17, 33)
"""Numbers of points of a band, refined in turn."""
CONTRACTION_ROUNDS = 12
"""Rounds of contracting and pushing out for each number of points."""
KNOWN_ROUNDS = 6
"""Rounds of contracting and pushing out a path that was known between ends nearby."""
FINAL_ROUNDS = 4
"""Rounds of pushing out the finely resampled band at the end."""
FINAL_POINT_COUNT = 8 * POINT_COUNTS[-1]
"""Number of points of a finished path."""
MAX_PENETRATION = 1.5e-3
"""Depth to which a band may cut into an obstacle between its points [m]."""
INITIAL_AMPLITUDES = (0.25, 0.5, 1.0, 2.0)
"""Amplitudes of the initial bands that are tried, relative to the straight distance [-]."""
JOIN_COUNT = 8
"""Number of points of a path at which either end may join it."""
MAX_JOIN_SOLIDS = 8
"""Solids near the lines that join a path above which none is sought."""
JOIN_SPACING = 0.002
"""Distance of the points on the lines from the ends to the path that they join [m]."""
NORMAL_STEP = 1e-5
"""Step of the central differences for an obstacle's normal [m]."""

Bands = Float64[np.ndarray, "bands n 3"]


@dataclass(frozen=True)
class ShortPath:
    """Path between two points outside all obstacles."""

    ends: Float64[np.ndarray, "2 3"]
    """Its ends [m]."""
    points: Float64[np.ndarray, "n 3"] | None
    """Points along it [m]; None where no path was found."""
    length: float
    """Its length [m]; infinite where no path was found."""
    contracted: bool = True
    """Whether it was searched; one that was joined to other ends is longer than it need be."""

    @classmethod
    def straight(cls, ends: Float64[np.ndarray, "2 3"]) -> ShortPath:
        """Return the straight line between two ends."""
        points = polylines.resample(ends, FINAL_POINT_COUNT)
        return cls(ends, points, float(np.linalg.norm(ends[1] - ends[0])))

    def avoids(self, obstacle: Obstacle) -> bool:
        """Return whether the path stays outside an obstacle."""
        if self.points is None:
            return False
        return bool(np.min(signed_distance(self.points, obstacle)) > -MAX_PENETRATION)


class PathSearch:
    """Search for a short path outside all obstacles, in steps of bounded work."""

    def __init__(
        self,
        left: Float64[np.ndarray, "3"],
        right: Float64[np.ndarray, "3"],
        obstacles: Sequence[Obstacle],
        known: ShortPath | None = None,
        max_length: float = np.inf,
    ) -> None:
        """Begin a search.

        Args:
            left: First end [m].
            right: Second end [m].
            obstacles: Obstacles to go round; those that contain an end are ignored.
            known: Path between ends nearby.
            max_length: Length up to which a path near the known one is short enough [m].
        """
        self._steps = _search(np.stack([left, right]), obstacles, known, max_length)

    def advance(self, steps: int) -> tuple[ShortPath | None, int]:
        """Return the path once it is found, and the number of steps that are left.

        Args:
            steps: Largest number of steps.
        """
        for taken in range(steps):
            try:
                next(self._steps)
            except StopIteration as end:
                return end.value, steps - taken - 1
        return None, 0


def joined(
    path: ShortPath, ends: Float64[np.ndarray, "2 3"], scene: ObstacleScene
) -> ShortPath | None:
    """Return a path whose ends join a known one by straight lines; None where none is clear.

    It is not contracted anew, and longer than the shortest one by what that would gain.

    Args:
        path: Path between other ends, with points.
        ends: Ends of the new path [m].
        scene: Obstacles to go round; those that contain an end are ignored, and half spaces, which
            are in the way of no line between points outside.
    """
    points = path.points
    if points is None or any(
        # The path was searched without the obstacles that contain its ends.
        np.min(signed_distance(path.ends, obstacle)) <= 0.0
        for obstacle in scene.at(path.ends)
    ):
        return None
    middle, last = len(points) // 2, len(points) - 1
    places = np.linspace([0, middle], [middle, last], JOIN_COUNT).astype(int).T
    starts = np.repeat(ends, JOIN_COUNT, axis=0)
    targets = points[places.ravel()]
    near = np.flatnonzero(scene.touched(starts, targets).any(axis=0))
    if len(near) > MAX_JOIN_SOLIDS:
        return None
    clear = np.ones(2 * JOIN_COUNT, dtype=bool)
    for obstacle in (scene.solids[k] for k in near):
        if np.min(signed_distance(ends, obstacle)) > 0.0:
            clear &= segment_distance(starts, targets, obstacle) > -MAX_PENETRATION
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    lengths = np.linalg.norm(starts - targets, axis=1)
    lengths += np.abs(along[places.ravel()] - along[middle])
    first, second = np.where(clear, lengths, np.inf).reshape(2, JOIN_COUNT)
    if not (np.isfinite(first).any() and np.isfinite(second).any()):
        return None
    i, j = places[0, np.argmin(first)], places[1, np.argmin(second)]
    whole = [_line(ends[0], points[i]), points[i + 1 : j], _line(points[j], ends[1])]
    length = float(first.min() + second.min())
    return ShortPath(ends, np.concatenate(whole), length, contracted=False)


def _line(
    start: Float64[np.ndarray, "3"], end: Float64[np.ndarray, "3"]
) -> Float64[np.ndarray, "k 3"]:
    count = 2 + int(np.linalg.norm(end - start) / JOIN_SPACING)
    return np.linspace(start, end, count)


def shortest_path_length(
    left: Float64[np.ndarray, "3"],
    right: Float64[np.ndarray, "3"],
    obstacles: Sequence[Obstacle],
) -> float:
    """Return the length of a short path outside all obstacles; infinite where none is found [m].

    Args:
        left: First end [m].
        right: Second end [m].
        obstacles: Obstacles to go round; those that contain an end are ignored.
    """
    search = PathSearch(left, right, obstacles)
    found = None
    while found is None:
        found, _ = search.advance(1000)
    return found.length


def _search(
    ends: Float64[np.ndarray, "2 3"],
    obstacles: Sequence[Obstacle],
    known: ShortPath | None,
    max_length: float,
) -> Generator[None, None, ShortPath]:
    """Yield after each step, and return the path."""
    outside, blocked = [], False
    for obstacle in obstacles:
        # An end inside an obstacle breaks another rule, and no path leads round that obstacle.
        if np.min(signed_distance(ends, obstacle)) > 0.0:
            outside.append(obstacle)
            blocked = blocked or _is_between(ends, obstacle)
        yield
    if not blocked:
        return ShortPath.straight(ends)
    if known is not None and known.points is not None:
        near = _moved(known.points, ends)[None]
        near = yield from _contracted(near, POINT_COUNTS[-1:], KNOWN_ROUNDS, outside)
        found = yield from _finished(ends, near, outside)
        if found.length <= max_length:
            return found
    bands = yield from _initial_bands(ends, outside)
    bands = yield from _contracted(bands, POINT_COUNTS, CONTRACTION_ROUNDS, outside)
    return (yield from _finished(ends, bands, outside))


def _is_between(ends: Float64[np.ndarray, "2 3"], obstacle: Obstacle) -> bool:
    """Return whether an obstacle that holds no end is in the way of the straight line."""
    if obstacle.shape == "half_space" or not ObstacleScene([obstacle]).touched(*ends[:, None])[0]:
        return False
    return bool(segment_distance(ends[:1], ends[1:], obstacle)[0] < 0.0)


def _moved(
    points: Float64[np.ndarray, "n 3"], ends: Float64[np.ndarray, "2 3"]
) -> Float64[np.ndarray, "n 3"]:
    """Return a path with other ends, its points moved along with them."""
    share = np.linspace(0.0, 1.0, len(points))[:, None]
    return points + (1.0 - share) * (ends[0] - points[0]) + share * (ends[1] - points[-1])


def _contracted(
    bands: Bands, counts: Sequence[int], rounds: int, obstacles: Sequence[Obstacle]
) -> Generator[None, None, Bands]:
    """Return bands of refined numbers of points, contracted and pushed out in turn."""
    for count in counts:
        bands = _resampled(bands, count)
        for _ in range(rounds):
            bands[:, 1:-1] = 0.5 * (bands[:, :-2] + bands[:, 2:])
            bands[:, 1:-1] = yield from _pushed_out(bands[:, 1:-1], obstacles)
    return bands


def _finished(
    ends: Float64[np.ndarray, "2 3"], bands: Bands, obstacles: Sequence[Obstacle]
) -> Generator[None, None, ShortPath]:
    """Return the shortest band that stays outside; of infinite length where none does."""
    # Between its points a band cuts edges; each round brings it closer to them.
    for _ in range(FINAL_ROUNDS):
        bands = yield from _pushed_out(_resampled(bands, FINAL_POINT_COUNT), obstacles)
    deepest = np.full(len(bands), np.inf)
    for obstacle in obstacles:
        depths = signed_distance((bands[:, :-1] + bands[:, 1:]) / 2.0, obstacle)
        deepest = np.minimum(deepest, np.min(depths, axis=1))
        yield
    paths = [
        ShortPath(ends, band, polylines.length(band)) for band in bands[deepest > -MAX_PENETRATION]
    ]
    return min(paths, key=lambda path: path.length, default=ShortPath(ends, None, np.inf))


def _initial_bands(
    ends: Float64[np.ndarray, "2 3"], obstacles: Sequence[Obstacle]
) -> Generator[None, None, Bands]:
    """Return half waves wide enough to be free, so that contracting keeps each to its side."""
    t = np.linspace(0.0, 1.0, POINT_COUNTS[-1])[:, None]
    axis = ends[1] - ends[0]
    straight = ends[0] + t * axis
    waves = np.sin(np.pi * t) * float(np.linalg.norm(axis)) * _sides(axis)[:, None]
    bands = straight + INITIAL_AMPLITUDES[-1] * waves
    found = np.zeros(len(bands), dtype=bool)
    for amplitude in INITIAL_AMPLITUDES:
        tried = straight + amplitude * waves
        free = ~found
        for obstacle in obstacles:
            free &= np.min(signed_distance(tried, obstacle), axis=1) > 0.0
            yield
        bands[free], found = tried[free], found | free
    return bands


def _sides(axis: Float64[np.ndarray, "3"]) -> Float64[np.ndarray, "4 3"]:
    """Return four unit vectors across an axis."""
    axis = axis / max(float(np.linalg.norm(axis)), 1e-12)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    return np.array([first, -first, second, -second])


def _resampled(bands: Bands, count: int) -> Bands:
    return np.array([polylines.resample(band, count) for band in bands])


def _pushed_out(points: Bands, obstacles: Sequence[Obstacle]) -> Generator[None, None, Bands]:
    """Return the points, those inside an obstacle moved to its surface along its normal."""
    points = points.copy()
    for obstacle in obstacles:
        if _may_contain(obstacle, points):
            distance = signed_distance(points, obstacle)
            inside = distance < 0.0
            if np.any(inside):
                normals = _normals(points[inside], obstacle)
                points[inside] -= distance[inside, None] * normals
        yield
    return points


def _may_contain(obstacle: Obstacle, points: Bands) -> bool:
    """Return whether a point lies in the bounding sphere of an obstacle."""
    if obstacle.shape == "half_space":
        return True
    offsets = points - np.array(obstacle.position)
    nearest = float(np.min(np.einsum("...i,...i->...", offsets, offsets)))
    return nearest < bounding_radius(obstacle) ** 2


def _normals(points: Float64[np.ndarray, "n 3"], obstacle: Obstacle) -> np.ndarray:
    """Return the outward unit normals of an obstacle at points."""
    shifted = points[:, None] + NORMAL_STEP * np.concatenate([np.eye(3), -np.eye(3)])
    d = signed_distance(shifted, obstacle)
    normals = d[:, :3] - d[:, 3:]
    return normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)

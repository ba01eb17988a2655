"""Short path round obstacles between two points, whose length bounds that of the shortest one.

The path is straight where no obstacle is in the way. Otherwise a path that is known between ends
nearby is joined to them by straight lines and pulled tight (`taut_path`): it leads through openings
as the rope does that was led through them. Where none is short enough, others are sought by elastic
bands (Quinlan and Khatib, 1993). Each begins on one of four sides of the obstacles, is contracted
and pushed out of the obstacles in turn, and is refined from few points to many; the shortest one
that stays outside is pulled tight. What is found is a path, so its length is never below the
shortest one except for what a line may cut into a solid (`line_of_sight`). Where nothing is found,
the length is infinite.

A search takes longer than a tick of the gateway, and longer the more obstacles there are: it
advances in steps of some 0.1 ms.
"""

from __future__ import annotations

from collections.abc import Generator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.safety.constraints.line_of_sight import MAX_PENETRATION, LineOfSight
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.taut_path import normals, pushed_out, string_pulled, without_needless

POINT_COUNTS = (5, 9, 17, 33)
"""Numbers of points of a band, refined in turn."""
CONTRACTION_ROUNDS = 12
"""Rounds of contracting and pushing out for each number of points."""
FINAL_ROUNDS = 4
"""Rounds of pushing out the finely resampled band at the end."""
FINAL_POINT_COUNT = 8 * POINT_COUNTS[-1]
"""Number of points of a finished path."""
INITIAL_AMPLITUDES = (0.25, 0.5, 1.0, 2.0)
"""Amplitudes of the initial bands that are tried, relative to the straight distance [-]."""
JOIN_COUNT = 48
"""Number of points of a path at which either end may join it."""
REPAIRS = 4
"""Number of times that points are put between those where a solid cuts a path."""
REPAIR_STEPS = 3
"""Steps that the repair of a path counts for."""

Bands = Float64[np.ndarray, "bands n 3"]


@dataclass(frozen=True)
class ShortPath:
    """Path between two points outside all obstacles."""

    ends: Float64[np.ndarray, "2 3"]
    """Its ends [m]."""
    points: Float64[np.ndarray, "n 3"] | None
    """Its ends and the corners between them [m]; None where no path was found."""
    length: float
    """Its length [m]; infinite where no path was found."""
    contracted: bool = True
    """Whether it is tight; one that was joined to other ends is longer than it need be."""

    @classmethod
    def straight(cls, ends: Float64[np.ndarray, "2 3"]) -> ShortPath:
        """Return the straight line between two ends."""
        return cls(ends, ends, float(np.linalg.norm(ends[1] - ends[0])))

    def avoids(self, obstacle: Obstacle) -> bool:
        """Return whether the path stays outside an obstacle."""
        if self.points is None:
            return False
        if obstacle.shape == "half_space":
            return bool(np.min(signed_distance(self.points, obstacle)) > -MAX_PENETRATION)
        sight = LineOfSight(ObstacleScene([obstacle]))
        # An end inside is in the way of nothing that begins there, but the path is cut.
        inside = signed_distance(self.points, sight.cores[0]) < 0.0
        return bool(not inside.any() and sight.clear(self.points[:-1], self.points[1:]).all())


class PathSearch:
    """Search for a short path outside all obstacles, in steps of bounded work."""

    def __init__(
        self,
        left: Float64[np.ndarray, "3"],
        right: Float64[np.ndarray, "3"],
        obstacles: Sequence[Obstacle],
        near: ShortPath | None = None,
        max_length: float = np.inf,
    ) -> None:
        """Begin a search.

        Args:
            left: First end [m].
            right: Second end [m].
            obstacles: Obstacles to go round; those that contain an end are ignored.
            near: Path between ends nearby.
            max_length: Length up to which a path near the known one is short enough [m].
        """
        self._steps = _search(np.stack([left, right]), obstacles, near, max_length)

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
    path: ShortPath, ends: Float64[np.ndarray, "2 3"], sight: LineOfSight
) -> ShortPath | None:
    """Return a path whose ends join a known one by straight lines; None where none is clear.

    It is not pulled tight, and longer than the shortest one by what that would gain.

    Args:
        path: Path between other ends, with points.
        ends: Ends of the new path [m].
        sight: Lines of sight past the obstacles to go round; those that contain an end of the new
            path are ignored, and half spaces, which are in the way of no line between points
            outside.
    """
    if path.points is None or not ends_outside(path, sight):
        return None
    points = polylines.resample(path.points, JOIN_COUNT)
    points = _with_corners(path.points, points)
    along = polylines.arc_lengths(points)
    middle = int(np.searchsorted(along, along[-1] / 2.0))
    first = _joining(ends[0], points[: middle + 1], sight) - along[: middle + 1]
    second = _joining(ends[1], points[middle:], sight) + along[middle:]
    i, j = int(np.argmin(first)), middle + int(np.argmin(second))
    if not np.isfinite(first[i] + second[j - middle]):
        return None
    whole = np.concatenate([ends[:1], points[i : j + 1], ends[1:]])
    corners = without_needless(whole, sight)
    return ShortPath(ends, corners, polylines.length(corners), contracted=False)


def _joining(
    end: Float64[np.ndarray, "3"], points: Float64[np.ndarray, "n 3"], sight: LineOfSight
) -> Float64[np.ndarray, "n"]:
    """Return the lengths of straight lines to points, infinite for those that are not clear [m]."""
    starts = np.repeat(end[None], len(points), axis=0)
    lengths = np.linalg.norm(points - starts, axis=1)
    return np.where(sight.clear(starts, points, from_inside=True), lengths, np.inf)


def ends_outside(path: ShortPath, sight: LineOfSight) -> bool:
    """Return whether no obstacle contains an end of a path, which then avoids all of them."""
    return all(
        np.min(signed_distance(path.ends, obstacle)) > 0.0 for obstacle in sight.scene.at(path.ends)
    )


def _with_corners(
    corners: Float64[np.ndarray, "n 3"], points: Float64[np.ndarray, "m 3"]
) -> Float64[np.ndarray, "k 3"]:
    """Return evenly spaced points of a path and its corners, in their order."""
    total = polylines.length(corners)
    places = np.concatenate([np.linspace(0.0, total, len(points)), polylines.arc_lengths(corners)])
    order = np.argsort(places, kind="stable")
    return np.concatenate([points, corners])[order]


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
    path = None
    while path is None:
        path, _ = search.advance(1000)
    return path.length


def _search(
    ends: Float64[np.ndarray, "2 3"],
    obstacles: Sequence[Obstacle],
    near: ShortPath | None,
    max_length: float,
) -> Generator[None, None, ShortPath]:
    """Yield after each step, and return the path."""
    outside = []
    for obstacle in obstacles:
        # An end inside an obstacle breaks another rule, and no path leads round that obstacle.
        if np.min(signed_distance(ends, obstacle)) > 0.0:
            outside.append(obstacle)
        yield
    sight = LineOfSight(ObstacleScene(outside))
    if sight.clear(ends[:1], ends[1:])[0]:
        return ShortPath.straight(ends)
    yield
    path = None if near is None else joined(near, ends, sight)
    if path is not None:
        path = yield from _tightened(path, sight)
        if path.length <= max_length:
            return path
    bands = yield from _initial_bands(ends, outside)
    bands = yield from _contracted(bands, outside)
    other = yield from _finished(ends, bands, sight)
    if other.points is not None:
        other = yield from _tightened(other, sight)
    return other if path is None or other.length < path.length else path


def _tightened(path: ShortPath, sight: LineOfSight) -> Generator[None, None, ShortPath]:
    """Return a path pulled tight."""
    assert path.points is not None
    pulling = string_pulled(path.points, sight)
    while True:
        try:
            steps = next(pulling)
        except StopIteration as end:
            return ShortPath(path.ends, end.value, polylines.length(end.value))
        for _ in range(steps):
            yield


def _contracted(bands: Bands, obstacles: Sequence[Obstacle]) -> Generator[None, None, Bands]:
    """Return bands of refined numbers of points, contracted and pushed out in turn."""
    for count in POINT_COUNTS:
        bands = _resampled(bands, count)
        for _ in range(CONTRACTION_ROUNDS):
            bands[:, 1:-1] = 0.5 * (bands[:, :-2] + bands[:, 2:])
            bands[:, 1:-1] = yield from _pushed_out(bands[:, 1:-1], obstacles)
    return bands


def _finished(
    ends: Float64[np.ndarray, "2 3"], bands: Bands, sight: LineOfSight
) -> Generator[None, None, ShortPath]:
    """Return the shortest band that stays outside; of infinite length where none does."""
    # Between its points a band cuts edges; each round brings it closer to them.
    for _ in range(FINAL_ROUNDS):
        bands = yield from _pushed_out(_resampled(bands, FINAL_POINT_COUNT), sight.scene.obstacles)
    best = ShortPath(ends, None, np.inf)
    for band in bands:
        points = _repaired(band, sight) if polylines.length(band) < best.length else None
        if points is not None and (length := polylines.length(points)) < best.length:
            best = ShortPath(ends, points, length)
        for _ in range(REPAIR_STEPS):
            yield
    return best


def _repaired(
    points: Float64[np.ndarray, "n 3"], sight: LineOfSight
) -> Float64[np.ndarray, "m 3"] | None:
    """Return a path with further points where a solid cuts it; None if it does still."""
    for _ in range(REPAIRS):
        cut = np.flatnonzero(~sight.clear(points[:-1], points[1:]))
        if not len(cut):
            return points
        middles = 0.5 * (points[cut] + points[cut + 1])
        near = np.flatnonzero(sight.scene.touched(points[cut], points[cut + 1]).any(axis=0))
        points = np.insert(points, cut + 1, pushed_out(middles, near, sight), axis=0)
    return points if sight.clear(points[:-1], points[1:]).all() else None


def _initial_bands(
    ends: Float64[np.ndarray, "2 3"], obstacles: Sequence[Obstacle]
) -> Generator[None, None, Bands]:
    """Return half waves wide enough to be free, so that contracting keeps each to its side."""
    t = np.linspace(0.0, 1.0, POINT_COUNTS[-1])[:, None]
    axis = ends[1] - ends[0]
    straight = ends[0] + t * axis
    waves = np.sin(np.pi * t) * float(np.linalg.norm(axis)) * _sides(axis)[:, None]
    bands = straight + INITIAL_AMPLITUDES[-1] * waves
    settled = np.zeros(len(bands), dtype=bool)
    for amplitude in INITIAL_AMPLITUDES:
        tried = straight + amplitude * waves
        free = ~settled
        for obstacle in obstacles:
            free &= np.min(signed_distance(tried, obstacle), axis=1) > 0.0
            yield
        bands[free], settled = tried[free], settled | free
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
                points[inside] -= distance[inside, None] * normals(points[inside], obstacle)
        yield
    return points


def _may_contain(obstacle: Obstacle, points: Bands) -> bool:
    """Return whether a point lies in the bounding sphere of an obstacle."""
    if obstacle.shape == "half_space":
        return True
    offsets = points - np.array(obstacle.position)
    nearest = float(np.min(np.einsum("...i,...i->...", offsets, offsets)))
    return nearest < obstacle.bounding_radius**2

"""Paths that are remembered, whose lengths bound that of the shortest one between ends nearby.

A path grows by no more than its ends move, but only where they move along straight lines that are
clear: beyond a wall, a path that is known on this side of it says nothing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import Obstacle, segment_distance, signed_distance
from shared.constraints.obstacle_scene import ObstacleScene
from shared.constraints.shortest_path import MAX_PENETRATION, ShortPath

KEPT_PATHS = 32
"""Number of paths that are remembered."""
MAX_CHECKED_SOLIDS = 8
"""Solids against which one evaluation checks straight lines, some 0.2 ms each."""
TRIED_PATHS = 3
"""Number of paths that are tried for a pose."""
KEPT_BALLS = 8
"""Number of balls that are remembered for an end of a path."""


@dataclass
class KnownEnd:
    """End of a path, and balls from every point of which a straight line to it is clear."""

    point: Float64[np.ndarray, "3"]
    """The end [m]."""
    balls: deque[tuple[np.ndarray, float]] = field(default_factory=lambda: deque(maxlen=KEPT_BALLS))
    """Centres and radii [m]."""

    def sees(self, points: Float64[np.ndarray, "m 3"]) -> Bool[np.ndarray, "m"]:
        """Return which points are the end itself, or in one of the balls."""
        seen = np.all(points == self.point, axis=1)
        for centre, radius in self.balls:
            seen |= np.linalg.norm(points - centre, axis=1) < radius
        return seen


@dataclass(frozen=True)
class KnownPath:
    """Path that is remembered."""

    path: ShortPath
    """The path."""
    ends: tuple[KnownEnd, KnownEnd]
    """Its ends."""

    @classmethod
    def of(cls, path: ShortPath) -> KnownPath:
        """Return a path whose surroundings are not known yet."""
        return cls(path, (KnownEnd(path.ends[0]), KnownEnd(path.ends[1])))


class KnownPaths:
    """Remembered paths of one scene."""

    def __init__(self) -> None:
        self.scene = ObstacleScene()
        self._paths: deque[KnownPath] = deque(maxlen=KEPT_PATHS)

    def add(self, path: ShortPath) -> None:
        """Remember a path; the oldest one may be forgotten."""
        self._paths.append(KnownPath.of(path))

    def replace_scene(self, scene: ObstacleScene) -> None:
        """Take another scene, and forget the paths that new or moved obstacles cut."""
        new = set(scene.obstacles) - set(self.scene.obstacles)
        kept = (p.path for p in self._paths if all(p.path.avoids(obstacle) for obstacle in new))
        self._paths = deque(map(KnownPath.of, kept), maxlen=KEPT_PATHS)
        self.scene = scene

    def nearest(self, ends: Float64[np.ndarray, "2 3"]) -> ShortPath | None:
        """Return the searched path whose ends are nearest; None where there is none."""
        paths = (known.path for known in self._paths)
        found = (p for p in paths if p.points is not None and p.contracted)
        return min(found, key=lambda p: float(np.linalg.norm(p.ends - ends)), default=None)

    def upper_bounds(
        self, positions: Float64[np.ndarray, "m 2 3"]
    ) -> tuple[Float64[np.ndarray, "m"], Float64[np.ndarray, "m"]]:
        """Return upper bounds on the shortest paths, and what the ends' motion adds to them [m].

        Args:
            positions: Ends of m paths [m].
        """
        count = len(positions)
        if not self._paths:
            return np.full(count, np.inf), np.full(count, np.inf)
        ends = np.array([known.path.ends for known in self._paths])
        moved = np.linalg.norm(positions[:, None] - ends, axis=-1).sum(axis=-1)
        bounds = moved + [known.path.length for known in self._paths]
        rows = np.arange(count)
        unproven = np.ones(count, dtype=bool)
        nearest = np.argmin(bounds, axis=1)
        for _ in range(TRIED_PATHS):
            unproven &= np.isfinite(bounds[rows, nearest])
            for k in np.unique(nearest[unproven]):
                chosen = np.flatnonzero(unproven & (nearest == k))
                clear = self._in_reach(self._paths[k], positions[chosen])
                unproven[chosen[clear]] = False
                bounds[chosen[~clear], k] = np.inf
            if not unproven.any():
                break
            nearest = np.argmin(bounds, axis=1)
        bounds[unproven] = np.inf
        return bounds[rows, nearest], moved[rows, nearest]

    def _in_reach(
        self, known: KnownPath, positions: Float64[np.ndarray, "k 2 3"]
    ) -> Bool[np.ndarray, "k"]:
        """Return for which poses straight lines lead to both ends of a path."""
        clear = np.ones(len(positions), dtype=bool)
        for side, end in enumerate(known.ends):
            points = positions[:, side]
            rows = np.flatnonzero(clear & ~end.sees(points))
            if not len(rows):
                continue
            gaps, radii = self._gaps(points[rows], end.point)
            clear[rows] = gaps > -MAX_PENETRATION
            # Lines from points nearby are no farther away than those points.
            for k in range(len(rows) - 1, -1, -1):
                if radii[k] > 0.0 and not end.sees(points[rows[k]][None])[0]:
                    end.balls.append((points[rows[k]].copy(), float(radii[k])))
        return clear

    def _gaps(
        self, points: Float64[np.ndarray, "k 3"], end: Float64[np.ndarray, "3"]
    ) -> tuple[Float64[np.ndarray, "k"], Float64[np.ndarray, "k"]]:
        """Return the distances of straight lines from the obstacles, and the radii of the balls.

        An obstacle that holds the point from which a line begins is ignored, as by a search; no
        ball is there.

        Args:
            points: Points from which the lines begin [m].
            end: Point to which they lead [m].
        """
        scene = self.scene
        ends = np.broadcast_to(end, points.shape)
        bounds = scene.line_distances(points, ends)
        touched = bounds < 0.0
        gaps = np.min(bounds, axis=1, where=~touched, initial=np.inf)
        radii = gaps.copy()
        columns = np.flatnonzero(touched.any(axis=0))
        for n, column in enumerate(columns):
            rows = np.flatnonzero(touched[:, column])
            if n >= MAX_CHECKED_SOLIDS:
                gaps[rows] = radii[rows] = -np.inf
                continue
            solid = scene.solids[column]
            distance = segment_distance(points[rows], ends[rows], solid)
            inside = signed_distance(points[rows], solid) <= 0.0
            gaps[rows] = np.minimum(gaps[rows], np.where(inside, np.inf, distance))
            radii[rows] = np.minimum(radii[rows], distance)
        for space in scene.half_spaces:
            if not _outside(end, space):
                gaps[signed_distance(points, space) > 0.0] = -np.inf
                radii[:] = 0.0
        return gaps, radii


def _outside(point: Float64[np.ndarray, "3"], obstacle: Obstacle) -> bool:
    """Return whether a point is outside an obstacle, or hardly inside."""
    return bool(signed_distance(point[None], obstacle)[0] > -MAX_PENETRATION)

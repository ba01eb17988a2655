"""Paths that are remembered, whose lengths bound that of the shortest one between ends nearby.

Other ends are joined to the outermost corners of a known path by straight lines, where these are
clear: beyond a wall, a path that is known on this side of it says nothing.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import signed_distance
from lariat.safety.constraints.line_of_sight import MAX_PENETRATION, LineOfSight
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.shortest_path import ShortPath, ends_outside

KEPT_PATHS = 32
"""Number of paths that are remembered."""
STRAIGHT_POINTS = 33
"""Number of points of a straight path of which that nearest to a solid counts as its corner."""
SPACING = 0.005
"""Motion of the ends from which on two paths are remembered beside each other [m]."""


@dataclass(frozen=True)
class KnownPath:
    """Path that is remembered."""

    path: ShortPath
    """The path."""
    anchors: Float64[np.ndarray, "2 3"]
    """Points that other ends are joined to: its outermost corners [m]."""
    inner_length: float
    """Length of the path between them [m]."""

    @classmethod
    def of(cls, path: ShortPath, sight: LineOfSight) -> KnownPath:
        """Return a path with its anchors.

        Args:
            path: The path.
            sight: Lines of sight of its scene.
        """
        if path.points is None or not ends_outside(path, sight):
            # It leads through an obstacle that contains an end, and serves for ends there only.
            return cls(path, path.ends, path.length)
        inner = path.points[1:-1]
        if not len(inner):
            inner = _narrowest(path.ends, sight)[None]
        return cls(path, inner[[0, -1]], polylines.length(inner))


class GeodesicCache:
    """Remembered paths of one scene."""

    def __init__(self) -> None:
        self.scene = ObstacleScene()
        self.sight = LineOfSight(self.scene)
        self._paths: deque[KnownPath] = deque(maxlen=KEPT_PATHS)
        self._stack()

    def add(self, path: ShortPath) -> None:
        """Remember a path in place of those near it that are longer; or of the oldest one."""
        kept = (entry for entry in self._paths if not _replaces(path, entry.path))
        self._paths = deque(kept, maxlen=KEPT_PATHS)
        self._paths.append(KnownPath.of(path, self.sight))
        self._stack()

    def add_straight(self, ends: Float64[np.ndarray, "2 3"]) -> None:
        """Remember a straight path, if none with ends nearby was the last one to be remembered."""
        if self._paths:
            last = self._paths[-1].path
            moved = np.linalg.norm(last.ends - ends, axis=1).sum()
            if last.points is not None and len(last.points) == 2 and moved < SPACING:
                return
        self.add(ShortPath.straight(ends))

    def replace_scene(self, scene: ObstacleScene) -> None:
        """Take another scene, and forget the paths that new or moved obstacles cut."""
        new = set(scene.obstacles) - set(self.scene.obstacles)
        kept = [p.path for p in self._paths if all(p.path.avoids(obstacle) for obstacle in new)]
        self.scene, self.sight = scene, LineOfSight(scene)
        self._paths = deque((KnownPath.of(path, self.sight) for path in kept), maxlen=KEPT_PATHS)
        self._stack()

    def _stack(self) -> None:
        """Lay ends, anchors and lengths of all paths side by side."""
        self._ends = np.array([entry.path.ends for entry in self._paths]).reshape(-1, 2, 3)
        self._anchors = np.array([entry.anchors for entry in self._paths]).reshape(-1, 2, 3)
        self._inner = np.array([entry.inner_length for entry in self._paths])

    def nearest(self, ends: Float64[np.ndarray, "2 3"]) -> ShortPath | None:
        """Return the searched path whose ends are nearest; None where there is none."""
        paths = (entry.path for entry in self._paths)
        searched = (p for p in paths if p.points is not None and p.contracted)
        return min(searched, key=lambda p: float(np.linalg.norm(p.ends - ends)), default=None)

    def upper_bounds(
        self, positions: Float64[np.ndarray, "m 2 3"]
    ) -> tuple[Float64[np.ndarray, "m"], Float64[np.ndarray, "m"]]:
        """Return upper bounds on the shortest paths, and the distances of known ends [m].

        Args:
            positions: Ends of m paths [m].
        """
        count = len(positions)
        if not self._paths:
            return np.full(count, np.inf), np.full(count, np.inf)
        moved = np.linalg.norm(positions[:, None] - self._ends, axis=-1).sum(axis=-1)
        bounds = np.linalg.norm(positions[:, None] - self._anchors, axis=-1).sum(axis=-1)
        bounds += self._inner
        nearest = np.argmin(bounds, axis=1)
        left = np.arange(count)
        for _ in range(len(self._paths)):
            clear = self._in_reach(positions[left], self._anchors[nearest[left]])
            left = left[~clear]
            bounds[left, nearest[left]] = np.inf
            nearest[left] = np.argmin(bounds[left], axis=1)
            left = left[np.isfinite(bounds[left, nearest[left]])]
            if not len(left):
                break
        rows = np.arange(count)
        return bounds[rows, nearest], moved[rows, nearest]

    def _in_reach(
        self, positions: Float64[np.ndarray, "k 2 3"], anchors: Float64[np.ndarray, "k 2 3"]
    ) -> Bool[np.ndarray, "k"]:
        """Return for which poses straight lines lead to both anchors of a path."""
        # The lines of one side share their surroundings, and few solids are there.
        clear = self.sight.clear(positions[:, 0], anchors[:, 0], True)
        clear[clear] = self.sight.clear(positions[clear, 1], anchors[clear, 1], True)
        for space in self.scene.half_spaces:
            # Such a path leads through it, for an end inside.
            inside = np.min(signed_distance(anchors, space), axis=1) <= -MAX_PENETRATION
            clear &= ~inside | (np.min(signed_distance(positions, space), axis=1) <= 0.0)
        return np.asarray(clear)


def _replaces(path: ShortPath, other: ShortPath) -> bool:
    """Return whether a path is short enough to be remembered in place of one near it."""
    moved = float(np.linalg.norm(path.ends - other.ends, axis=1).sum())
    return moved < SPACING and path.length <= other.length + moved


def _narrowest(ends: Float64[np.ndarray, "2 3"], sight: LineOfSight) -> Float64[np.ndarray, "3"]:
    """Return the point of a straight line that is nearest to a solid; its middle where none is."""
    points = ends[0] + np.linspace(0.0, 1.0, STRAIGHT_POINTS)[:, None] * (ends[1] - ends[0])
    touched = np.flatnonzero(sight.scene.touched(ends[:1], ends[1:])[0])
    if not len(touched):
        return points[STRAIGHT_POINTS // 2]
    distances = [signed_distance(points, sight.scene.solids[k]) for k in touched]
    return points[int(np.argmin(np.min(distances, axis=0)))]

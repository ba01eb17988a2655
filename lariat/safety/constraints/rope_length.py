"""Rope length constraint: the rope reaches round all obstacles (rule `overstretch`)."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle
from lariat.safety.constraints.geodesic_cache import GeodesicCache
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.shortest_path import PathSearch, ShortPath, joined

MIN_AHEAD_SLACK = 0.08
"""Slack below which a path is searched before the known ones do not suffice any more [m]: a search
takes some 0.2 s."""
MIN_LOOSENESS = 0.01
"""Excess of a bound over the path that it follows from, below which none is searched ahead [m]."""
MAX_JOINS = 2
"""Poses of one evaluation whose ends are joined to a remembered path, for some 1 ms each."""
SEARCH_STEPS = 10
"""Steps of a search in one evaluation of the constraint, some 0.1 ms each; a tick evaluates it
a few times."""


class RopeLengthConstraint:
    """Length of the shortest path round the obstacles between the grips.

    Paths are expensive, so a few are remembered, each of which bounds the length for all poses
    nearby (`GeodesicCache`). Where they do not suffice, another
    one is searched, a few steps at every evaluation. Until it is found, what is not known to be
    short enough counts as too long.
    """

    def __init__(self, max_length: float) -> None:
        """Create the constraint without obstacles.

        Args:
            max_length: Longest permitted path between the grips [m].
        """
        self.max_length = max_length
        self._paths = GeodesicCache()
        self._search: PathSearch | None = None
        self._steps = SEARCH_STEPS
        self._joined = False
        """Whether a path was joined to other ends since one was searched."""
        self.searching = False
        """Whether a path was missing in the last evaluation, and is being searched."""

    @contextmanager
    def finishing_searches(self) -> Iterator[None]:
        """Let every search end within its evaluation; for a cell at rest."""
        self._steps = np.iinfo(np.int64).max
        try:
            yield
        finally:
            self._steps = SEARCH_STEPS

    def replace_scene(self, scene: ObstacleScene) -> None:
        """Take another scene, and forget the paths that new or moved obstacles cut."""
        if scene.obstacles == self._scene.obstacles:
            return
        self._search = None
        self._paths.replace_scene(scene)

    @property
    def _scene(self) -> ObstacleScene:
        return self._paths.scene

    def slack(
        self, positions: Float64[np.ndarray, "m 2 3"], distances: Float64[np.ndarray, "m"]
    ) -> Float64[np.ndarray, "m"]:
        """Return by how much the path between the grips is shorter than permitted, at m poses [m].

        Args:
            positions: Positions of both grips, the present ones first [m].
            distances: Straight distances between them [m].
        """
        return self.max_length - self._lengths(positions, distances)

    def _lengths(
        self, positions: Float64[np.ndarray, "m 2 3"], distances: Float64[np.ndarray, "m"]
    ) -> Float64[np.ndarray, "m"]:
        """Return upper bounds on the shortest paths, tight where they exceed the limit [m]."""
        self.searching = False
        if not np.any(self._scene.touched(positions[:, 0], positions[:, 1])):
            return distances
        steps = self._steps
        lengths, looseness = self._paths.upper_bounds(positions)
        exact = np.zeros(len(positions), dtype=bool)
        far = np.flatnonzero(lengths > self.max_length)
        exact[far] = self._paths.sight.clear(positions[far, 0], positions[far, 1], True)
        lengths[exact] = distances[exact]
        if exact.any():
            # A search for poses nearby begins with it.
            self._paths.add_straight(positions[np.flatnonzero(exact)[-1]])
        joins = MAX_JOINS
        while np.any(unsure := ~exact & (lengths > self.max_length)):
            worst = int(np.argmax(np.where(unsure, lengths, -np.inf)))
            joins -= 1
            if joins >= 0 and self._join(positions[worst]):
                bounds, looseness = self._paths.upper_bounds(positions)
                lengths = np.minimum(lengths, bounds)
                continue
            path, steps = self._advance_search(positions[worst], steps)
            if path is None:
                self.searching = True
                lengths[unsure] = np.inf
                if unsure[0]:
                    # Otherwise the present pose, not known either, would excuse all others.
                    lengths[0] = self.max_length
                break
            exact |= np.all(positions == path.ends, axis=(1, 2))
            bounds, looseness = self._paths.upper_bounds(positions)
            lengths = np.minimum(lengths, bounds)
            if worst > 0 and exact[worst] and lengths[worst] > self.max_length:
                break
        ahead = (lengths > self.max_length - MIN_AHEAD_SLACK) & (looseness > MIN_LOOSENESS)
        begun = self._search is not None or self._joined
        if steps > 0 and not self.searching and (begun or np.any(ahead)):
            # What was begun for a refused pose is finished while the arms stand before it.
            worst = int(np.argmax(lengths))
            self._advance_search(positions[worst], min(steps, SEARCH_STEPS))
        return np.maximum(lengths, distances)

    def _join(self, ends: Float64[np.ndarray, "2 3"]) -> bool:
        """Remember the nearest path joined to other ends, if it is short enough then."""
        nearest = self._paths.nearest(ends)
        path = None if nearest is None else joined(nearest, ends, self._paths.sight)
        if path is None or path.length > self.max_length:
            return False
        self._paths.add(path)
        self._joined = True
        return True

    def _advance_search(
        self, ends: Float64[np.ndarray, "2 3"], steps: int
    ) -> tuple[ShortPath | None, int]:
        """Continue the search, or begin one, and remember the path that it finds.

        Args:
            ends: Ends of a search that begins [m].
            steps: Number of steps that are left.
        """
        if self._search is None:
            self._search = PathSearch(
                ends[0], ends[1], self._reachable(ends), self._paths.nearest(ends), self.max_length
            )
        path, steps = self._search.advance(steps)
        if path is not None:
            self._search, self._joined = None, False
            self._paths.add(path)
        return path, steps

    def _reachable(self, ends: Float64[np.ndarray, "2 3"]) -> list[Obstacle]:
        """Return the obstacles that a path of the permitted length may touch."""
        scene = self._scene
        if not len(scene.radii):
            return scene.half_spaces
        detours = np.linalg.norm(ends[:, None] - scene.centres, axis=-1).sum(axis=0)
        near = np.flatnonzero(detours - 2.0 * scene.radii <= self.max_length)
        return [*scene.half_spaces, *(scene.solids[k] for k in near)]

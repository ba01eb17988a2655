"""Lines of sight past many solids at once, by where they enter and leave each of them."""

from __future__ import annotations

from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.shapes import SHAPES

MAX_PENETRATION = 5e-4
"""Depth to which a path may cut into a solid [m]."""
MAX_PENETRATED_SHARE = 0.25
"""The same relative to half of the solid's least extent, so that a thin one is not ignored [-]."""

STRICT_SHARE = 0.5
"""Part of the penetrable depth that a line may penetrate where it is to be moved later [-]."""

Points = Float64[np.ndarray, "m 3"]


def penetrable_depth(solid: Obstacle) -> float:
    """Return the depth to which a path may cut into a solid [m]."""
    least = solid.thickness / 2.0
    return min(MAX_PENETRATION, MAX_PENETRATED_SHARE * least)


@lru_cache(maxsize=1024)
def core_of(solid: Obstacle, share: float = 1.0) -> Obstacle:
    """Return the part of a solid that a path may not enter.

    Args:
        solid: The solid.
        share: Part of the penetrable depth that is penetrated [-].
    """
    depth = share * penetrable_depth(solid)
    return solid.with_sizes(solid.row.shrunk(solid.packed_sizes, depth))


class LineOfSight:
    """Lines that solids cut, by the parts of these that a path may not enter."""

    def __init__(self, scene: ObstacleScene, share: float = 1.0) -> None:
        """Create the lines of sight of a scene; a half space is in no way between points outside.

        Args:
            scene: Obstacles.
            share: Part of the penetrable depth that lines may penetrate [-].
        """
        self.scene = scene
        self.cores = [core_of(solid, share) for solid in scene.solids]
        """Parts of the solids that a path may not enter."""
        self.depths = [penetrable_depth(solid) for solid in scene.solids]
        """Depths to which a path may cut into the solids [m]."""
        self._shapes = np.array([solid.shape for solid in self.cores])
        turns = [solid.orientation for solid in self.cores]
        self._turned_back = poses.conjugate(np.array(turns).reshape(-1, 4))
        self._sizes = np.array([solid.packed_sizes for solid in self.cores]).reshape(-1, 3)

    @cached_property
    def strict(self) -> LineOfSight:
        """Lines of sight that leave room to move the ends of what is clear."""
        return LineOfSight(self.scene, STRICT_SHARE)

    def clear(
        self, starts: Points, ends: Points, from_inside: bool = False
    ) -> Bool[np.ndarray, "m"]:
        """Return which straight lines no solid cuts.

        Args:
            starts: First ends of the lines [m].
            ends: Other ends [m].
            from_inside: Whether a solid is not in the way of lines that begin inside it: a grip
                there breaks another rule.
        """
        result = np.ones(len(starts), dtype=bool)
        near = self.scene.near(np.concatenate([starts, ends]))
        rows, columns = np.nonzero(self.scene.line_distances(starts, ends, near) < 0.0)
        if not len(rows):
            return result
        columns = near[columns]
        turned_back = self._turned_back[columns]
        local = starts[rows] - self.scene.centres[columns]
        begins = poses.rotate(turned_back, local)
        steps = poses.rotate(turned_back, ends[rows] - starts[rows])
        cut = np.zeros(len(rows), dtype=bool)
        shapes = self._shapes[columns]
        for shape, row in SHAPES.items():
            of_shape = np.flatnonzero(shapes == shape)
            if len(of_shape):
                sizes = self._sizes[columns[of_shape]]
                inside, cut_there = row.cuts(sizes, begins[of_shape], steps[of_shape])
                cut[of_shape] = cut_there & ~inside if from_inside else cut_there
        result[rows[cut]] = False
        return result

"""Lines of sight past many solids at once, by where they enter and leave each of them."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np
from jaxtyping import Bool, Float64, Int64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.safety.constraints.obstacle_scene import ObstacleScene

MAX_PENETRATION = 5e-4
"""Depth to which a path may cut into a solid [m]."""
MAX_PENETRATED_SHARE = 0.25
"""The same relative to half of the solid's least extent, so that a thin one is not ignored [-]."""

STRICT_SHARE = 0.5
"""Part of the penetrable depth that a line may penetrate where it is to be moved later [-]."""

Points = Float64[np.ndarray, "m 3"]


def penetrable_depth(solid: Obstacle) -> float:
    """Return the depth to which a path may cut into a solid [m]."""
    match solid.shape:
        case "box":
            least = min(solid.size) / 2.0
        case "cylinder":
            least = min(solid.radius, solid.height / 2.0)
        case _:
            least = solid.radius
    return min(MAX_PENETRATION, MAX_PENETRATED_SHARE * least)


@lru_cache(maxsize=1024)
def core_of(solid: Obstacle, share: float = 1.0) -> Obstacle:
    """Return the part of a solid that a path may not enter.

    Args:
        solid: The solid.
        share: Part of the penetrable depth that is penetrated [-].
    """
    depth = share * penetrable_depth(solid)
    x, y, z = (max(size - 2.0 * depth, 0.0) for size in solid.size)
    height = solid.height - 2.0 * depth if solid.shape == "cylinder" else solid.height
    return replace(solid, size=(x, y, z), radius=max(solid.radius - depth, 0.0), height=height)


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
        sizes = [solid.size for solid in self.cores]
        self._halves = np.array(sizes).reshape(-1, 3) / 2.0
        self._radii = np.array([solid.radius for solid in self.cores])
        heights = [0.0 if solid.shape == "sphere" else solid.height for solid in self.cores]
        self._half_heights = np.array(heights) / 2.0

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
        for shape, cuts in (
            ("box", self._box_cuts),
            ("cylinder", self._cylinder_cuts),
            ("capsule", self._round_cuts),
            ("sphere", self._round_cuts),
        ):
            of_shape = np.flatnonzero(shapes == shape)
            if len(of_shape):
                inside, cut_there = cuts(begins[of_shape], steps[of_shape], columns[of_shape])
                cut[of_shape] = cut_there & ~inside if from_inside else cut_there
        result[rows[cut]] = False
        return result

    def _box_cuts(
        self, begins: Points, steps: Points, columns: Int64[np.ndarray, "m"]
    ) -> tuple[Bool[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        """Return which lines begin inside and which pass inside boxes, in whose frames they are."""
        low, high = _within(begins, steps, self._halves[columns])
        inside = np.all(np.abs(begins) < self._halves[columns], axis=1)
        return inside, np.max(low, axis=1) < np.min(high, axis=1)

    def _cylinder_cuts(
        self, begins: Points, steps: Points, columns: Int64[np.ndarray, "m"]
    ) -> tuple[Bool[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        """Return the same for cylinders."""
        low, high = _within(begins[:, 2:], steps[:, 2:], self._half_heights[columns, None])
        a = np.maximum(np.sum(steps[:, :2] ** 2, axis=1), 1e-18)
        b = np.sum(steps[:, :2] * begins[:, :2], axis=1)
        c = np.sum(begins[:, :2] ** 2, axis=1) - self._radii[columns] ** 2
        root = b * b - a * c
        half = np.sqrt(np.maximum(root, 0.0))
        enters = np.maximum((-b - half) / a, low[:, 0])
        leaves = np.minimum((-b + half) / a, high[:, 0])
        inside = (c < 0.0) & (np.abs(begins[:, 2]) < self._half_heights[columns])
        return inside, (root > 0.0) & (enters < leaves)

    def _round_cuts(
        self, begins: Points, steps: Points, columns: Int64[np.ndarray, "m"]
    ) -> tuple[Bool[np.ndarray, "m"], Bool[np.ndarray, "m"]]:
        """Return the same for capsules or spheres."""
        half, radius = self._half_heights[columns], self._radii[columns]
        beyond = begins[:, 2] - np.clip(begins[:, 2], -half, half)
        inside = begins[:, 0] ** 2 + begins[:, 1] ** 2 + beyond**2 < radius**2
        # Closest points of two segments (Ericson, Real-Time Collision Detection, 2005, 5.1.9).
        flat = np.maximum(np.sum(steps[:, :2] ** 2, axis=1), 1e-18)
        share = np.clip(-np.sum(begins[:, :2] * steps[:, :2], axis=1) / flat, 0.0, 1.0)
        along = np.clip(begins[:, 2] + share * steps[:, 2], -half, half)
        lengths = np.maximum(np.sum(steps**2, axis=1), 1e-18)
        begins = begins - along[:, None] * np.array([0.0, 0.0, 1.0])
        share = np.clip(-np.sum(begins * steps, axis=1) / lengths, 0.0, 1.0)
        at = begins + share[:, None] * steps
        beyond = at[:, 2] + along - np.clip(at[:, 2] + along, -half, half)
        nearest = at[:, 0] ** 2 + at[:, 1] ** 2 + beyond**2
        return inside, nearest < radius**2


def _within(
    begins: Float64[np.ndarray, "m k"],
    steps: Float64[np.ndarray, "m k"],
    halves: Float64[np.ndarray, "m k"],
) -> tuple[Float64[np.ndarray, "m k"], Float64[np.ndarray, "m k"]]:
    """Return from which to which part of a line each coordinate is within its bounds."""
    along = np.where(np.abs(steps) < 1e-12, 1e-12, steps)
    one, other = (-halves - begins) / along, (halves - begins) / along
    return np.maximum(np.minimum(one, other), 0.0), np.minimum(np.maximum(one, other), 1.0)

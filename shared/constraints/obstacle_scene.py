"""Obstacles of the present scene with their bounding spheres."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from lariat.geometry.obstacles import Obstacle


class ObstacleScene:
    """Obstacles, parted into half spaces and solids."""

    def __init__(self, obstacles: Sequence[Obstacle] = ()) -> None:
        self.obstacles = tuple(obstacles)
        self.half_spaces = [o for o in self.obstacles if o.shape == "half_space"]
        self.solids = [o for o in self.obstacles if o.shape != "half_space"]
        self.centres = np.array([o.position for o in self.solids]).reshape(-1, 3)
        """Centres of the solids' bounding spheres [m]."""
        self.radii = np.array([bounding_radius(o) for o in self.solids])
        """Radii of the solids' bounding spheres [m]."""


def bounding_radius(obstacle: Obstacle) -> float:
    """Return the radius of the sphere around a solid's centre that contains it [m]."""
    match obstacle.shape:
        case "box":
            return float(np.linalg.norm(obstacle.size)) / 2.0
        case "cylinder":
            return float(np.hypot(obstacle.radius, obstacle.height / 2.0))
        case _:
            return obstacle.radius + obstacle.height / 2.0

"""Section of clips, which hold a cable that is laid into them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from lariat.configuration import Bounds
from lariat.geometry import obstacles as geometry
from lariat.geometry.cable_routes import LEGS
from lariat.scenario.sections.quantities import Position


@dataclass(frozen=True)
class Clip:
    """Clip that is open above: two round legs, between which a cable is laid and on which it may
    lean. It holds the cable whose centreline passes between its legs and below their tips."""

    name: str
    """Name, unique among clips; its legs are the obstacles `NAME-left` and `NAME-right`."""
    position: Position
    """Middle between the feet of its legs."""
    opening: Annotated[float, Bounds(5e-4, 0.2, "m")]
    """Distance between its legs."""
    height: Annotated[float, Bounds(1e-3, 1.0, "m")]
    """Height of its tips above `position`."""
    heading: Annotated[float, Bounds(-180.0, 180.0, "deg")] = 0.0
    """Direction of the cable through it, from the left end to the right one: its angle about the
    world's z, from x."""
    leg_radius: Annotated[float, Bounds(5e-4, 0.05, "m")] = 0.003
    """Radius of its legs, whose tips are round."""
    friction: Annotated[float, Bounds(0.0, 5.0)] = 0.0
    """Coefficient of friction that the model of the rope has on it."""

    def __post_init__(self) -> None:
        if self.height <= self.leg_radius:
            raise ValueError(
                f"height = {self.height} m of clip {self.name!r} must exceed leg_radius = "
                f"{self.leg_radius} m"
            )

    @property
    def bodies(self) -> tuple[geometry.Obstacle, geometry.Obstacle]:
        """Legs, as geometric bodies; their lower caps lie below `position`."""
        angle = math.radians(self.heading)
        across = np.array([-math.sin(angle), math.cos(angle), 0.0])
        height = self.height - self.leg_radius
        middle = np.array(self.position) + np.array([0.0, 0.0, 0.5 * height])
        away = (0.5 * self.opening + self.leg_radius) * across
        left, right = (
            geometry.Obstacle(
                "capsule",
                tuple((middle + side * away).tolist()),
                radius=self.leg_radius,
                height=height,
                support=True,
                friction=self.friction,
                name=self.name + leg,
            )
            for side, leg in zip((1.0, -1.0), LEGS, strict=True)
        )
        return left, right

"""Section `[[distractors]]`: what stands or moves in the simulated view beside rope and scene."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated

from lariat.configuration import Bounds
from lariat.scenario.sections import Color, Position, Vector

Shift = Annotated[Vector, Bounds(-20.0, 20.0, "m")]


@dataclass(frozen=True)
class Distractor:
    """Tube in the simulated images that no service is told of: another rope, a hand, an arm.

    The simulated rope passes through it without contact.
    """

    points: tuple[Position, ...]
    """Points of its axis; three or more are joined by a smooth curve."""
    diameter: Annotated[float, Bounds(5e-4, 0.5, "m")] = 0.008
    """Diameter of its cross-section."""
    color: Color = (255, 255, 255)
    """Its colour: red, green, blue."""
    times: tuple[Annotated[float, Bounds(0.0, 3600.0, "s")], ...] = ()
    """Rising times since the start of a run at which it is displaced by `shifts`; it moves evenly
    between them."""
    shifts: tuple[Shift, ...] = ()
    """Displacement from `points` at each of `times`."""

    def __post_init__(self) -> None:
        if len(self.points) < 2 or any(a == b for a, b in pairwise(self.points)):
            raise ValueError(
                f"points = {[list(p) for p in self.points]}; give at least two, each different "
                "from the one before"
            )
        if len(self.times) != len(self.shifts):
            raise ValueError(
                f"{len(self.times)} times for {len(self.shifts)} shifts; give one shift for each"
            )
        if any(a >= b for a, b in pairwise(self.times)):
            raise ValueError(f"times = {list(self.times)} must rise")

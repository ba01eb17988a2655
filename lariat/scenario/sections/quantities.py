"""Types that several sections share: vectors, lengths, colours, the ends of the rope."""

from __future__ import annotations

from typing import Annotated, Literal

from lariat.configuration import Bounds

Vector = tuple[float, float, float]
Quaternion = Annotated[tuple[float, float, float, float], Bounds(-1.0, 1.0, min_norm=0.5)]
Meters = Annotated[float, Bounds(1e-4, 100.0, "m")]
Position = Annotated[Vector, Bounds(-20.0, 20.0, "m")]
Color = Annotated[tuple[int, int, int], Bounds(0, 255)]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
"""Both ends of the rope, in the order of grips and arms."""

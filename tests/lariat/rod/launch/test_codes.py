"""Codes of the kernel have the order of the names in other modules."""

from __future__ import annotations

from lariat.geometry.obstacles import SHAPES
from lariat.rod.launch.codes import EndHold, ObstacleShape
from lariat.rod.launch.inputs import ENDS


def test_shapes_are_coded_in_the_order_of_packed_obstacles() -> None:
    assert tuple(shape.name.lower() for shape in ObstacleShape) == tuple(SHAPES)


def test_holds_are_coded_in_the_order_of_the_ends() -> None:
    assert tuple(hold.name.lower() for hold in EndHold) == ENDS

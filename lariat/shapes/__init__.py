"""Shapes of obstacles: one table, from which all that is known of a shape is taken.

A new shape is its class, its row here, and a branch in each kernel that knows `ShapeCode`: contact
of the rod (`lariat.rod.kernels.obstacle_contact`), of the paper's rod, and rays of the camera.
"""

from __future__ import annotations

from enum import IntEnum
from typing import Literal, TypeAlias

from lariat.shapes.box import Box
from lariat.shapes.capsule import Capsule, Sphere
from lariat.shapes.cone import Cone
from lariat.shapes.cylinder import Cylinder
from lariat.shapes.half_space import HalfSpace
from lariat.shapes.shape import BodyShape, Mesh

SolidName: TypeAlias = Literal["cylinder", "box", "sphere", "capsule", "cone"]
"""Names of the shapes with a closed surface."""
ShapeName: TypeAlias = Literal[SolidName, "half_space"]
"""Names of all shapes."""

SHAPES: dict[ShapeName, BodyShape] = {
    "cylinder": Cylinder(),
    "box": Box(),
    "sphere": Sphere(),
    "capsule": Capsule(),
    "half_space": HalfSpace(),
    "cone": Cone(),
}
"""Shapes by name; the place of a shape is its code in packed obstacles."""

ShapeCode = IntEnum("ShapeCode", [name.upper() for name in SHAPES], start=0)
"""Codes of the shapes in packed obstacles and kernels."""

__all__ = ["SHAPES", "BodyShape", "Mesh", "ShapeCode", "ShapeName", "SolidName"]

"""Properties of the rod that models a scenario's rope."""

from __future__ import annotations

from dataclasses import fields

from lariat.rod import RodProperties
from lariat.scenario.sections import Rope


def rod_properties(rope: Rope) -> RodProperties:
    """Return the properties of the rod that models a rope."""
    own = {field.name for field in fields(RodProperties)}
    properties = {k: v for k, v in vars(rope).items() if k in own and v is not None}
    if rope.bending_radius is not None:
        properties["yield_curvature"] = 1.0 / rope.bending_radius
    return RodProperties(**properties)

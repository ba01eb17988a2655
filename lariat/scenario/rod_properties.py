"""Properties of the rod that models a scenario's rope."""

from __future__ import annotations

from dataclasses import fields

from lariat.rod import RodProperties
from lariat.scenario.sections import Rope


def rod_properties(rope: Rope) -> RodProperties:
    """Return the properties of the rod that models a rope."""
    own = {field.name for field in fields(RodProperties)}
    return RodProperties(**{key: value for key, value in vars(rope).items() if key in own})

"""Properties of the rod that models a scenario's rope."""

from __future__ import annotations

from lariat.rod import RodProperties
from lariat.scenario.sections import Rope


def rod_properties(rope: Rope) -> RodProperties:
    """Return the properties of the rod that models a rope."""
    return RodProperties(
        length=rope.length,
        diameter=rope.diameter,
        linear_density=rope.linear_density,
        youngs_modulus=rope.youngs_modulus,
        poisson_ratio=rope.poisson_ratio,
        stretch_stiffness=rope.stretch_stiffness,
        damping=rope.damping,
        internal_damping=rope.internal_damping,
    )

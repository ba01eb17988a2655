"""Sections of the rope: as it is assumed, and as the simulated one differs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from lariat.configuration import Bounds
from lariat.scenario.sections.quantities import Vector


@dataclass(frozen=True)
class Rope:
    """Properties of the rope as the controller assumes them."""

    length: Annotated[float, Bounds(0.02, 20.0, "m")]
    """Length of the unstretched rope, with what lies in the grippers (`ends.*.grip_length`)."""
    diameter: Annotated[float, Bounds(5e-4, 0.1, "m")]
    """Diameter of its cross-section."""
    node_count: Annotated[int, Bounds(5, 400)] = 40
    """Number of nodes that represent the rope."""
    linear_density: Annotated[float, Bounds(1e-4, 20.0, "kg/m")] = 0.044
    """Mass per length."""
    youngs_modulus: Annotated[float, Bounds(1e3, 3e11, "Pa")] = 1.0e6
    """Young's modulus E; the bending stiffness is EI = E pi d^4 / 64."""
    poisson_ratio: Annotated[float, Bounds(-0.5, 0.5)] = 0.3
    """Poisson's ratio nu; the twisting stiffness is GJ = EI / (1 + nu)."""
    stretch_stiffness: Annotated[float, Bounds(1.0, 1e8, "N")] = 2000.0
    """Axial force per strain, EA."""
    damping: Annotated[float, Bounds(0.0, 100.0, "1/s")] = 1.0
    """Decay rate of the velocity, in whatever direction."""
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.0
    """Viscous moment per rate of curvature, divided by EI (Kelvin-Voigt); likewise in twist."""
    drag_coefficient: Annotated[float, Bounds(0.0, 100.0)] = 0.0
    """Drag coefficient of air across the rope, about 1.1 for a smooth one."""

    def __post_init__(self) -> None:
        if self.diameter > 0.25 * self.length:
            raise ValueError(
                f"diameter = {self.diameter} m is more than a quarter of length = {self.length} m; "
                "a rod is slender: check the units"
            )


@dataclass(frozen=True)
class PlantRope:
    """Properties in which the true rope differs from `[rope]`."""

    length: Annotated[float, Bounds(0.02, 20.0, "m")] | None = None
    diameter: Annotated[float, Bounds(5e-4, 0.1, "m")] | None = None
    node_count: Annotated[int, Bounds(5, 1200)] | None = None
    """Number of nodes; by default every edge of `[rope]` is three edges."""
    linear_density: Annotated[float, Bounds(1e-4, 20.0, "kg/m")] | None = None
    youngs_modulus: Annotated[float, Bounds(1e3, 3e11, "Pa")] | None = None
    poisson_ratio: Annotated[float, Bounds(-0.5, 0.5)] | None = None
    stretch_stiffness: Annotated[float, Bounds(1.0, 1e8, "N")] | None = None
    damping: Annotated[float, Bounds(0.0, 100.0, "1/s")] | None = None
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] | None = None
    """As in `[rope]`; for the models `rod` and `links`."""
    drag_coefficient: Annotated[float, Bounds(0.0, 100.0)] | None = None
    stiffness_profile: tuple[float, ...] = ()
    """Factors on the stiffness at even distances along the rope, left end first."""
    rest_curvature: Annotated[Vector, Bounds(-200.0, 200.0, "1/m")] = (0.0, 0.0, 0.0)
    """Curvature (two) and twist per length of the unloaded rope."""

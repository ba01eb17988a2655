"""Sections of the rope: as it is assumed, and as the simulated one differs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from lariat.configuration import Bounds
from lariat.scenario.sections.quantities import Vector

Section = Literal["round", "rectangular"]
"""Cross-section of a rope that yields."""


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
    yield_curvature: Annotated[float, Bounds(1e-3, 1e4, "1/m")] | None = None
    """Curvature above which the rope keeps a bend; by default it keeps none."""
    bending_radius: Annotated[float, Bounds(1e-4, 1e3, "m")] | None = None
    """Least bending radius of a data sheet, in place of `yield_curvature`, which is one over it."""
    section: Section = "round"
    """Cross-section, which says how yield spreads over it."""
    hardening: Annotated[float, Bounds(0.0, 0.99)] = 0.002
    """Share of the stiffness that stays elastic at any curvature."""
    inner_friction: Annotated[float, Bounds(0.0, 0.99)] = 0.0
    """Share of the stiffness that friction between strands bears until they slip."""
    slip_curvature: Annotated[float, Bounds(1e-3, 1e4, "1/m")] = 1.0
    """Curvature, from the last reversal on, at which strands begin to slip."""

    def __post_init__(self) -> None:
        if self.yield_curvature is not None and self.bending_radius is not None:
            raise ValueError(
                f"yield_curvature = {self.yield_curvature:g} 1/m and bending_radius = "
                f"{self.bending_radius:g} m say the same; leave out one of them"
            )
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
    yield_curvature: Annotated[float, Bounds(1e-3, 1e4, "1/m")] | None = None
    """As in `[rope]`, and the four below it; for the models `rod` and `links`."""
    bending_radius: Annotated[float, Bounds(1e-4, 1e3, "m")] | None = None
    section: Section | None = None
    hardening: Annotated[float, Bounds(0.0, 0.99)] | None = None
    inner_friction: Annotated[float, Bounds(0.0, 0.99)] | None = None
    slip_curvature: Annotated[float, Bounds(1e-3, 1e4, "1/m")] | None = None
    stiffness_profile: tuple[float, ...] = ()
    """Factors on the stiffness at even distances along the rope, left end first."""
    rest_curvature: Annotated[Vector, Bounds(-200.0, 200.0, "1/m")] = (0.0, 0.0, 0.0)
    """Curvature (two) and twist per length of the unloaded rope."""

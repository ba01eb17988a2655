"""Section of the rope."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from lariat.configuration import Bounds


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
    """Decay rate of the velocity, as by air drag."""
    internal_damping: Annotated[float, Bounds(0.0, 1.0, "s")] = 0.0
    """Viscous moment per rate of curvature, divided by EI (Kelvin-Voigt); likewise in twist."""

    def __post_init__(self) -> None:
        if self.diameter > 0.25 * self.length:
            raise ValueError(
                f"diameter = {self.diameter} m is more than a quarter of length = {self.length} m; "
                "a rod is slender: check the units"
            )

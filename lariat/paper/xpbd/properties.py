"""Parameters of a rope in the paper (Table 1), and their counterparts in SI units."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.rod.properties import RodProperties, interpolate_knots

INEXTENSIBLE_STIFFNESS = 1e7
"""Stretch stiffness of the continuous counterpart of the paper's inextensible rope [N]."""
PAPER_MASS = 0.5
"""Mass m of Table 1 [kg]."""


@dataclass(frozen=True)
class XpbdProperties:
    """Parameters of a rope for `XpbdRod`.

    The motion depends on the ratios m : I : 1 / beta_b only, not on their common scale.

    Raises:
        ValueError: A field is out of its range.
    """

    length: float
    """Rest length L [m]."""
    diameter: float
    """Diameter; nodes keep half of it from obstacles [m]."""
    mass: float = PAPER_MASS
    """Mass m of every node [kg]. The paper does not say whether its 0.5 kg is that of a node or of
    the rope: spread over 40 nodes, Gauss-Seidel sweeps let the rod shrink instead of bending."""
    inertia: float = 0.05
    """Rotational inertia I of every edge, the same about all axes [kg m^2]."""
    linear_damping: float = 0.1
    """Share xi_v of the velocity that is lost in a second [-]."""
    angular_damping: float = 0.3
    """Share xi_omega of the angular velocity that is lost in a second [-]."""
    bending_compliance: float = 0.003
    """Compliance beta_b of eq. (7) at every inner node, in bending and twisting alike [m^2/N]."""
    contact_compliance: float = 0.0
    """Compliance beta of a collision [m/N]. The paper uses 1, with which eq. (11) has no effect at
    its time step: nothing would be pushed out."""
    rest_curvature: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    """Curvature about d1 and d2 and twist at rest, evenly spaced from left to right [1/m]."""

    def __post_init__(self) -> None:
        for name in ("length", "diameter", "mass", "inertia", "bending_compliance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be a positive number, got {value} (in SI units)")
        if not (math.isfinite(self.contact_compliance) and self.contact_compliance >= 0.0):
            raise ValueError(
                f"contact_compliance must be zero or more, got {self.contact_compliance} m/N"
            )
        for name in ("linear_damping", "angular_damping"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(
                    f"{name} must be the share lost in a second, from 0 to 1, got {value}"
                )
        if self.diameter >= self.length:
            raise ValueError(
                f"diameter must be less than length, got diameter={self.diameter} m and "
                f"length={self.length} m; are both in metres?"
            )
        rest = np.asarray(self.rest_curvature, dtype=float)
        if rest.ndim != 2 or rest.shape[1] != 3 or not np.all(np.isfinite(rest)):
            raise ValueError(
                f"rest_curvature must be rows of three finite numbers, got "
                f"{self.rest_curvature}; ((0, 0, 0),) is straight"
            )

    @classmethod
    def of_material(cls, material: RodProperties, node_count: int) -> XpbdProperties:
        """Return the rope with the dimensions, damping and bending-to-inertia ratio of a rod.

        Its mass is the paper's, since the common scale has no effect.

        Args:
            material: Continuous rod.
            node_count: Number of nodes of the `XpbdRod`.
        """
        edge = material.length / (node_count - 1)
        mass = PAPER_MASS
        compliance = edge / (4.0 * material.bending_stiffness)
        damping = min(1.0 - math.exp(-material.damping), 0.999)
        return cls(
            material.length,
            material.diameter,
            mass=mass,
            linear_damping=damping,
            angular_damping=damping,
            bending_compliance=compliance * material.linear_density * edge / mass,
            rest_curvature=material.rest_curvature,
        )

    def material(self, node_count: int) -> RodProperties:
        """Return the continuous rod to which this one converges with its iterations.

        |Im(conj(q) q')| = sin(angle / 2), hence EI = GJ = l / (4 beta_b) with edge length l.
        The rotational inertia I has no counterpart in a real rope.

        Args:
            node_count: Number of nodes of the `XpbdRod`.
        """
        edge = self.length / (node_count - 1)
        stiffness = edge / (4.0 * self.bending_compliance)
        bare = RodProperties(
            self.length,
            self.diameter,
            linear_density=self.mass / edge,
            youngs_modulus=1.0,
            stretch_stiffness=INEXTENSIBLE_STIFFNESS,
            damping=-math.log(1.0 - self.linear_damping),
            rest_curvature=self.rest_curvature,
        )
        return bare.with_stiffness(stiffness, stiffness)

    def rest_darboux(
        self, places: Float64[np.ndarray, "k"], lengths: Float64[np.ndarray, "k"]
    ) -> Float64[np.ndarray, "k 3"]:
        """Return the rest Darboux vectors Omega^0 of eq. (7) [-].

        Args:
            places: `RodModel.bend_places` [-].
            lengths: `RodModel.bend_lengths` [m].
        """
        rest = interpolate_knots(np.asarray(self.rest_curvature, float), places)
        turn = lengths[:, None] * rest
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        return 0.5 * np.sinc(angle / (2.0 * np.pi)) * turn

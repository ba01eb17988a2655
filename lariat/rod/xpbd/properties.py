"""The paper's parameters of a rope (Table 1), and what they mean in newtons and metres."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.rod.properties import RodProperties

INEXTENSIBLE = 1e7
"""Stretch stiffness that stands for the paper's inextensible rope in `material` [N]."""


@dataclass(frozen=True)
class XpbdProperties:
    """One rope for `XpbdRod`. Only m : I : 1 / beta_b shows in its motion: their scale does not."""

    length: float
    """L, at rest [m]."""
    diameter: float
    """Nodes keep half of it from obstacles [m]."""
    mass: float = 0.5
    """m, of every node [kg]. The paper does not say whether its 0.5 kg is one node or all of them:
    spread over 40 nodes, Gauss-Seidel lets the rod shrink instead of bending."""
    inertia: float = 0.05
    """I, of every edge's orientation, the same about all axes [kg m^2]."""
    linear_damping: float = 0.1
    """xi_v, the share of velocity lost in a second [-]."""
    angular_damping: float = 0.3
    """xi_omega [-]."""
    bending_compliance: float = 0.003
    """beta_b, inverse stiffness of (7) at every inner node [m^2/N]; bends and twists alike."""
    contact_compliance: float = 0.0
    """beta of a collision [m/N]. The paper adds 1, which leaves 10^4 / m of (11) at its time step:
    nothing would be pushed out."""
    rest_curvature: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    """Curvature about d1 and d2 and twist at rest, evenly spaced from left to right [1/m]."""

    def __post_init__(self) -> None:
        for name in ("length", "diameter", "mass", "inertia", "bending_compliance"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be a positive number, got {value}; SI units")
        if not (math.isfinite(self.contact_compliance) and self.contact_compliance >= 0.0):
            raise ValueError(
                f"contact_compliance must be zero or more, got {self.contact_compliance} m/N"
            )
        for name in ("linear_damping", "angular_damping"):
            value = getattr(self, name)
            if not 0.0 <= value < 1.0:
                raise ValueError(f"{name} is the share lost in a second, 0 to 1, got {value}")
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
        """The rope of this scale and damping whose bending weighs against its inertia as given.

        Its mass is the paper's: the scale shows in nothing.
        """
        edge = material.length / (node_count - 1)
        mass = 0.5
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
        """The continuous rod that this one stands for, once its iterations have converged.

        |Im(conj(q) q')| = sin(angle / 2), so that beta_b holds EI = l / (4 beta_b); twist is as
        stiff. The rotational inertia I is none of a real rope's and has no counterpart.
        """
        edge = self.length / (node_count - 1)
        stiffness = edge / (4.0 * self.bending_compliance)
        bare = RodProperties(
            self.length,
            self.diameter,
            linear_density=self.mass / edge,
            youngs_modulus=1.0,
            stretch_stiffness=INEXTENSIBLE,
            damping=-math.log(1.0 - self.linear_damping),
            rest_curvature=self.rest_curvature,
        )
        return bare.with_stiffness(stiffness, stiffness)

    def rest_darboux(self, node_count: int) -> Float64[np.ndarray, "n-2 3"]:
        """Omega^0 of (7) at every inner node [-]."""
        edge = self.length / (node_count - 1)
        rows = np.asarray(self.rest_curvature, float)
        have = np.linspace(0.0, 1.0, len(rows)) if len(rows) > 1 else np.array([0.5])
        want = np.arange(1, node_count - 1) / (node_count - 1)
        turn = edge * np.stack([np.interp(want, have, column) for column in rows.T], axis=1)
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        return 0.5 * np.sinc(angle / (2.0 * np.pi)) * turn

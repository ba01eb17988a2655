"""Material and dimensions of a rod, in the units of a data sheet."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.rope_parameters import BY_NAME

Section = Literal["round", "rectangular"]
"""Cross-section, over which yield spreads from the outside."""
SECTION_LAYERS: dict[str, tuple[tuple[float, float], ...]] = {
    "round": ((0.3730, 1.126), (0.3534, 1.4899), (0.2182, 2.149), (0.0554, 5.0)),
    "rectangular": ((0.4438, 1.0755), (0.3439, 1.3957), (0.1844, 2.0615), (0.0279, 5.0)),
}
"""Share of what yields, and limit relative to the yield curvature, of each layer of a section.

Parallel elastic-perfectly plastic layers (Iwan, J. Appl. Mech. 1967), fitted with the default
hardening to the moments of bent wires: what is left of a curvature is within 0.007 of it of theirs.
"""
_POSITIVE_FIELDS = ("length", "diameter", "linear_density", "youngs_modulus", "stretch_stiffness")
"""Fields whose values must be positive."""


@dataclass(frozen=True)
class RodProperties:
    """Round rod of one material.

    Raises:
        ValueError: A field is out of its range.
    """

    length: float
    """Rest length [m]."""
    diameter: float
    """Diameter [m]."""
    linear_density: float
    """Mass per length [kg/m]."""
    youngs_modulus: float
    """Effective Young's modulus E of the whole cross-section [Pa]."""
    poisson_ratio: float = 0.3
    """Poisson's ratio, which sets the twisting stiffness GJ = EI / (1 + poisson_ratio) [-]."""
    stretch_stiffness: float = 2000.0
    """Stiffness EA of stretch and of shear [N]. Ropes hardly stretch: any large value serves."""
    damping: float = 1.0
    """Rate at which velocity decays, in whatever direction [1/s]."""
    internal_damping: float = 0.0
    """Retardation time of the material in bending and twisting (Kelvin-Voigt) [s].

    A rate of curvature r causes a moment of internal_damping times EI r, and of GJ r in twist.
    """
    drag_coefficient: float = 0.0
    """Drag coefficient of air that flows across the rod, about 1.1 for a smooth rope [-].

    A piece of length l is slowed by drag_coefficient air_density diameter l / 2 times the square of
    its speed across the rod.
    """
    stiffness_profile: tuple[float, ...] = (1.0,)
    """Factors on bending and twisting stiffness, evenly spaced from left to right [-]."""
    density_profile: tuple[float, ...] = (1.0,)
    """Factors on the linear density, evenly spaced from left to right [-]."""
    rest_curvature: tuple[tuple[float, float, float], ...] = ((0.0, 0.0, 0.0),)
    """Curvature about d1 and d2 and twist at rest, evenly spaced from left to right [1/m]."""
    yield_curvature: float = math.inf
    """Curvature above which the outermost fibre yields and the rod keeps a bend [1/m].

    That of a wire is the yield stress over E times its radius. The rod yields at a twist of
    sqrt(1 + poisson_ratio) times as much. Infinite for a rod that springs back.
    """
    section: Section = "round"
    """Cross-section, which says how yield spreads over it."""
    hardening: float = 0.002
    """Share of the stiffness that stays elastic at any curvature [-]; without any, a rod that has
    yielded all through has no equilibrium of its own."""
    inner_friction: float = 0.0
    """Share of the stiffness that friction between strands bears until they slip [-]."""
    slip_curvature: float = 1.0
    """Curvature, counted from the last reversal, at which strands begin to slip [1/m]."""
    friction_factor: float = 1.0
    """Factor on the coefficients of friction of all bodies [-]."""
    contact_stiffness: float = 1e6
    """Contact force per length of rod and depth of overlap, at least [N/m^2]; see
    `effective_contact_stiffness`."""
    contact_margin: float = 5e-4
    """Gap to an obstacle below which contact forces act [m]."""

    air_density: ClassVar[float] = 1.2
    """Density of the air [kg/m^3]."""

    def __post_init__(self) -> None:
        for name in (*_POSITIVE_FIELDS, "slip_curvature", "contact_stiffness", "contact_margin"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                raise ValueError(f"{name} must be a positive number, got {value} (in SI units)")
        for name, unit, usual in (
            ("damping", " 1/s", 1.0),
            ("internal_damping", " s", 0.01),
            ("drag_coefficient", "", 1.1),
            ("friction_factor", "", 1.0),
        ):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} must be zero or more, got {value}{unit}; try {usual}")
        for name in ("hardening", "inner_friction"):
            if not 0.0 <= getattr(self, name) < 1.0:
                raise ValueError(
                    f"{name} must be at least 0 and below 1, got {getattr(self, name)}; try 0.01"
                )
        if not self.yield_curvature > 0.0:
            raise ValueError(
                f"yield_curvature must be positive, got {self.yield_curvature} 1/m; it is one over "
                "the least radius to which the rod bends without keeping it"
            )
        if self.section not in get_args(Section):
            raise ValueError(
                f"section must be one of {', '.join(get_args(Section))}, got {self.section!r}"
            )
        if not (math.isfinite(self.poisson_ratio) and self.poisson_ratio > -1.0):
            raise ValueError(
                f"poisson_ratio must be above -1, got {self.poisson_ratio}; try 0.3 for a solid"
            )
        if self.diameter >= self.length:
            raise ValueError(
                f"diameter must be less than length, got diameter={self.diameter} m and "
                f"length={self.length} m; are both in metres?"
            )
        for name in ("stiffness_profile", "density_profile"):
            profile = np.asarray(getattr(self, name), dtype=float)
            positive = np.all(np.isfinite(profile)) and np.all(profile > 0.0)
            if profile.ndim != 1 or not len(profile) or not positive:
                raise ValueError(
                    f"{name} must be positive numbers, got {getattr(self, name)}; "
                    "(1.0,) is a uniform rod"
                )
        rest = np.asarray(self.rest_curvature, dtype=float)
        if rest.ndim != 2 or rest.shape[1] != 3 or not np.all(np.isfinite(rest)):
            raise ValueError(
                f"rest_curvature must be rows of three finite numbers, got "
                f"{self.rest_curvature}; ((0, 0, 0),) is straight"
            )

    @property
    def yields(self) -> bool:
        """Whether the rod keeps bends."""
        return math.isfinite(self.yield_curvature)

    @property
    def bending_stiffness(self) -> float:
        """Bending stiffness EI = E pi d^4 / 64 [N m^2]."""
        return self.youngs_modulus * math.pi * self.diameter**4 / 64.0

    @property
    def twisting_stiffness(self) -> float:
        """Twisting stiffness GJ = EI / (1 + poisson_ratio) [N m^2]."""
        return self.bending_stiffness / (1.0 + self.poisson_ratio)

    @property
    def twist_ratio(self) -> float:
        """Ratio of twisting to bending stiffness, GJ / EI [-]."""
        return self.twisting_stiffness / self.bending_stiffness

    @property
    def layers(self) -> Float64[np.ndarray, "l 3"]:
        """Layers that yield: share of the stiffness [-], curvature at which it yields [1/m], and
        derivative of that in the yield curvature [-]; none for a rod that springs back."""
        rows = []
        if self.inner_friction:
            rows.append([self.inner_friction, self.slip_curvature, 0.0])
        if math.isfinite(self.yield_curvature):
            share = (1.0 - self.inner_friction) * (1.0 - self.hardening)
            rows += [
                [share * part, limit * self.yield_curvature, limit]
                for part, limit in SECTION_LAYERS[self.section]
            ]
        return np.array(rows).reshape(-1, 3)

    @property
    def effective_contact_stiffness(self) -> float:
        """Contact stiffness k that is used [N/m^2].

        A beam on an elastic foundation k spreads a load over (4 EI / k)^(1/4); above two diameters
        the rod would sink in, so that k grows with EI. It grows in whole decades, which keeps it
        independent of small changes of EI.
        """
        needed = self.bending_stiffness / (4.0 * self.diameter**4)
        decades = math.ceil(math.log10(needed / self.contact_stiffness))
        return self.contact_stiffness * 10.0 ** max(0, decades)

    def with_stiffness(self, bending: float, twisting: float | None = None) -> RodProperties:
        """Return the same rod with other stiffnesses.

        Args:
            bending: Bending stiffness EI [N m^2].
            twisting: Twisting stiffness GJ [N m^2]; by default the ratio GJ / EI is kept.
        """
        changed = replace(self, youngs_modulus=64.0 * bending / (math.pi * self.diameter**4))
        if twisting is None:
            return changed
        return replace(changed, poisson_ratio=bending / twisting - 1.0)

    def with_values(self, values: Mapping[str, Sequence[float]]) -> RodProperties:
        """Return the same rod with other values of identified parameters.

        Args:
            values: Values by name, as in `rope_parameters.MATERIAL`; a scalar parameter has one.

        Raises:
            ValueError: A value is out of its range.
        """
        fields = {name: BY_NAME[name].attribute(of) for name, of in values.items()}
        stiffness = fields.pop("bending_stiffness", self.bending_stiffness)
        twist_ratio = fields.pop("twist_ratio", self.twist_ratio)
        return replace(self, **fields).with_stiffness(stiffness, twist_ratio * stiffness)

    def profile_at(self, places: Float64[np.ndarray, "k"]) -> Float64[np.ndarray, "k"]:
        """Return the stiffness factors at arc lengths over the rod's length [-]."""
        return interpolate_knots(np.asarray(self.stiffness_profile, float)[:, None], places)[:, 0]

    def density_at(self, node_count: int) -> Float64[np.ndarray, "n"]:
        """Return the density factors at all nodes [-]."""
        values = np.asarray(self.density_profile, float)
        return np.interp(
            np.linspace(0.0, 1.0, node_count), np.linspace(0.0, 1.0, len(values)), values
        )

    def rest_curvature_at(self, places: Float64[np.ndarray, "k"]) -> Float64[np.ndarray, "k 3"]:
        """Return the rest curvature at arc lengths over the rod's length [1/m]."""
        return interpolate_knots(np.asarray(self.rest_curvature, float), places)


def interpolate_knots(
    values: Float64[np.ndarray, "q c"], places: Float64[np.ndarray, "k"]
) -> Float64[np.ndarray, "k c"]:
    """Interpolate values that are evenly spaced over a rod at arc lengths over its length."""
    knots = np.linspace(0.0, 1.0, len(values)) if len(values) > 1 else np.array([0.5])
    return np.stack([np.interp(places, knots, column) for column in values.T], axis=1)

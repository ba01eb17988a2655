"""Unknowns of a rod as one vector, their prior, and their names.

Motion does not change when mass and stiffness are scaled together: the unknown stiffness is that
per linear density. Stiffnesses, dampings and profiles are logarithms; rest curvature is in radians
over the length of the rope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod.properties import RodProperties

CORE_GROUPS = ("stiffness", "damping", "internal_damping")
"""Groups of unknowns that short windows determine."""
PRIOR_DEVIATIONS = {
    "stiffness": 4.0,
    "twist_ratio": 1.0,
    "damping": 1.5,
    "internal_damping": 1.5,
    "length": 0.02,
    "stiffness_profile": 0.5,
    "density_profile": 0.3,
    "rest_curvature": 3.0,
}
"""Standard deviations of the prior: of logarithms [-], and of curvature [rad]."""
PROFILE_MEAN_DEVIATION = 0.02
"""Standard deviation of the mean logarithm of a profile [-]."""
GROUP_UNITS = {
    "stiffness": "m^4/s^2",
    "twist_ratio": "-",
    "damping": "1/s",
    "internal_damping": "s",
    "length": "m",
    "stiffness_profile": "-",
    "density_profile": "-",
    "rest_curvature": "1/m",
}
"""Units of the identified values of each group."""
MAX_DEPARTURES = {
    "stiffness": 12.0,
    "twist_ratio": 3.0,
    "damping": 5.0,
    "internal_damping": 5.0,
    "length": 0.1,
    "stiffness_profile": 2.0,
    "density_profile": 1.5,
    "rest_curvature": 100.0,
}
"""Largest magnitudes of the unknowns: of logarithms [-], and of curvature [rad]."""


@dataclass(frozen=True)
class Material:
    """Map from vectors of unknowns to rods; the vector of zeros is the prior mean."""

    mean: RodProperties
    """Prior mean, with the length of the rod at a length scale of one."""
    profile_knots: int = 1
    """Knots of the stiffness and density profiles; one for a uniform rod."""
    curvature_knots: int = 0
    """Knots of the rest curvature; zero for a rope that is straight at rest."""

    @property
    def groups(self) -> dict[str, slice]:
        """Place of each group of unknowns in the vector."""
        sizes = {
            "stiffness": 1,
            "twist_ratio": 1,
            "damping": 1,
            "internal_damping": 1,
            "length": 1,
            "stiffness_profile": self.profile_knots if self.profile_knots > 1 else 0,
            "density_profile": self.profile_knots if self.profile_knots > 1 else 0,
            "rest_curvature": 3 * self.curvature_knots,
        }
        found, at = {}, 0
        for name, size in sizes.items():
            if size:
                found[name] = slice(at, at + size)
            at += size
        return found

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return max(place.stop for place in self.groups.values())

    def per_unknown(self, values: dict[str, float]) -> Float64[np.ndarray, "P"]:
        """Return a vector with one value for all unknowns of each group."""
        spread = np.zeros(self.count)
        for name, place in self.groups.items():
            spread[place] = values[name]
        return spread

    def mask(self, names: tuple[str, ...]) -> Bool[np.ndarray, "P"]:
        """Return a mask of the unknowns that belong to the named groups."""
        return self.per_unknown({name: float(name in names) for name in self.groups}) > 0.0

    def clip(self, x: Float64[np.ndarray, "P"]) -> Float64[np.ndarray, "P"]:
        """Return the nearest vector within `MAX_DEPARTURES`."""
        limits = self.per_unknown(MAX_DEPARTURES)
        return np.clip(x, -limits, limits)

    def properties(self, x: Float64[np.ndarray, "P"]) -> RodProperties:
        """Return the properties of the rod of a vector."""
        at, mean = self.groups, self.mean
        stiffness = mean.bending_stiffness * math.exp(x[at["stiffness"]][0])
        ratio = mean.twisting_stiffness / mean.bending_stiffness
        ratio *= math.exp(x[at["twist_ratio"]][0])
        changed = {}
        for name in ("stiffness_profile", "density_profile"):
            if name in at:
                changed[name] = tuple(np.exp(x[at[name]]).tolist())
        if "rest_curvature" in at:
            rows = x[at["rest_curvature"]].reshape(-1, 3) / mean.length
            changed["rest_curvature"] = tuple(tuple(row) for row in rows.tolist())
        return replace(
            mean,
            length=mean.length * math.exp(x[at["length"]][0]),
            damping=mean.damping * math.exp(x[at["damping"]][0]),
            internal_damping=mean.internal_damping * math.exp(x[at["internal_damping"]][0]),
            **changed,
        ).with_stiffness(stiffness, ratio * stiffness)

    def prior_information(self, deviations: dict[str, float]) -> Float64[np.ndarray, "P P"]:
        """Return the inverse covariance of the prior, whose mean is zero.

        The mean of a profile is almost fixed: the stiffness or the density already scales it.

        Args:
            deviations: Standard deviation of each group of unknowns.
        """
        information = np.diag(1.0 / self.per_unknown(deviations) ** 2)
        for name in ("stiffness_profile", "density_profile"):
            if name in self.groups:
                place = self.groups[name]
                count = place.stop - place.start
                information[place, place] += 1.0 / (count * PROFILE_MEAN_DEVIATION) ** 2
        return information

    def parameter_jacobian(
        self, p: RodProperties, free: Bool[np.ndarray, "P"]
    ) -> tuple[tuple[str, ...], Float64[np.ndarray, "Q P"]]:
        """Return the names of parameters of the rod p, and their Jacobian in the free unknowns."""
        wanted: dict[int, list[tuple[str, float]]] = {}
        for name, place in self.groups.items():
            for k, at in enumerate(range(place.start, place.stop)):
                wanted[at] = (
                    _parameter_derivatives(p, name, k, self.mean.length) if free[at] else []
                )
        names = tuple(dict.fromkeys(name for terms in wanted.values() for name, _ in terms))
        chain = np.zeros((len(names), self.count))
        for at, terms in wanted.items():
            for name, derivative in terms:
                chain[names.index(name), at] = derivative
        return names, chain


def _parameter_derivatives(
    p: RodProperties, group: str, k: int, length: float
) -> list[tuple[str, float]]:
    """Return the parameters that change with one unknown, and their derivatives."""
    match group:
        case "stiffness":
            return [
                ("bending_stiffness", p.bending_stiffness),
                ("twisting_stiffness", p.twisting_stiffness),
            ]
        case "twist_ratio":
            return [("twisting_stiffness", p.twisting_stiffness)]
        case "damping" | "internal_damping":
            return [(group, getattr(p, group))]
        case "stiffness_profile" | "density_profile":
            return [(f"{group}[{k}]", getattr(p, group)[k])]
        case "rest_curvature":
            return [(f"{group}[{k // 3}][{k % 3}]", 1.0 / length)]
        case "length":
            return [("length", p.length)]
        case _:
            raise ValueError(f"no group of unknowns is called {group!r}")

"""The unknowns of a rod as one vector, what is believed of them beforehand, and their names.

Mass and stiffness scaled together leave every motion as it is, so stiffness is that per linear
density. Stiffnesses, dampings and profiles are logarithms; rest curvature is in radians over the
length of the rope.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod.properties import RodProperties

CORE = ("stiffness", "damping", "internal_damping")
"""What a rope's motion shows at once."""
SPREADS = {
    "stiffness": 4.0,
    "twist_ratio": 1.0,
    "damping": 1.5,
    "internal_damping": 1.5,
    "length": 0.02,
    "stiffness_profile": 0.5,
    "density_profile": 0.3,
    "rest_curvature": 3.0,
}
"""Standard deviations before anything was seen: of logarithms, and of curvature [rad]."""
LEVEL = 0.02
"""Standard deviation of a profile's mean logarithm [-]."""
UNITS = {
    "stiffness": "m^4/s^2",
    "twist_ratio": "-",
    "damping": "1/s",
    "internal_damping": "s",
    "length": "m",
    "stiffness_profile": "-",
    "density_profile": "-",
    "rest_curvature": "1/m",
}
LIMITS = {
    "stiffness": 12.0,
    "twist_ratio": 3.0,
    "damping": 5.0,
    "internal_damping": 5.0,
    "length": 0.1,
    "stiffness_profile": 2.0,
    "density_profile": 1.5,
    "rest_curvature": 100.0,
}
"""Most that an unknown may move away from what was believed; beyond lies no rope."""


@dataclass(frozen=True)
class Material:
    """Maps vectors of unknowns to rods around one that is believed."""

    believed: RodProperties
    """Of the length that the rod has at a length scale of one."""
    profile_knots: int = 1
    curvature_knots: int = 0
    """Zero for a rope that is taken to be straight at rest."""

    @property
    def groups(self) -> dict[str, slice]:
        """Where each group of unknowns stands in the vector."""
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
        """Of unknowns."""
        return max(place.stop for place in self.groups.values())

    def per_unknown(self, values: dict[str, float]) -> Float64[np.ndarray, "P"]:
        """One value per group, spread over its unknowns."""
        spread = np.zeros(self.count)
        for name, place in self.groups.items():
            spread[place] = values[name]
        return spread

    def chosen(self, names: tuple[str, ...]) -> Bool[np.ndarray, "P"]:
        """Which unknowns belong to groups."""
        return self.per_unknown({name: float(name in names) for name in self.groups}) > 0.0

    def bounded(self, x: Float64[np.ndarray, "P"]) -> Float64[np.ndarray, "P"]:
        """The nearest vector that still is a rope."""
        limits = self.per_unknown(LIMITS)
        return np.clip(x, -limits, limits)

    def properties(self, x: Float64[np.ndarray, "P"]) -> RodProperties:
        """The rod of a vector; zeros are what was believed."""
        at, believed = self.groups, self.believed
        stiffness = believed.bending_stiffness * math.exp(x[at["stiffness"]][0])
        ratio = believed.twisting_stiffness / believed.bending_stiffness
        ratio *= math.exp(x[at["twist_ratio"]][0])
        changed = {}
        for name in ("stiffness_profile", "density_profile"):
            if name in at:
                changed[name] = tuple(np.exp(x[at[name]]).tolist())
        if "rest_curvature" in at:
            rows = x[at["rest_curvature"]].reshape(-1, 3) / believed.length
            changed["rest_curvature"] = tuple(tuple(row) for row in rows.tolist())
        return replace(
            believed,
            length=believed.length * math.exp(x[at["length"]][0]),
            damping=believed.damping * math.exp(x[at["damping"]][0]),
            internal_damping=believed.internal_damping * math.exp(x[at["internal_damping"]][0]),
            **changed,
        ).with_stiffness(stiffness, ratio * stiffness)

    def belief(self, spreads: dict[str, float]) -> Float64[np.ndarray, "P P"]:
        """Information of what is believed: zero in each unknown, with standard deviations.

        Profiles are level on average, which leaves the mean to the stiffness itself.
        """
        information = np.diag(1.0 / self.per_unknown(spreads) ** 2)
        for name in ("stiffness_profile", "density_profile"):
            if name in self.groups:
                place = self.groups[name]
                count = place.stop - place.start
                information[place, place] += 1.0 / (count * LEVEL) ** 2
        return information

    def derivatives(
        self, p: RodProperties, free: Bool[np.ndarray, "P"]
    ) -> tuple[tuple[str, ...], Float64[np.ndarray, "Q P"]]:
        """Parameters of the rod p, by name, and their slopes in the free unknowns."""
        wanted: dict[int, list[tuple[str, float]]] = {}
        for name, place in self.groups.items():
            for k, at in enumerate(range(place.start, place.stop)):
                wanted[at] = _slopes(p, name, k, self.believed.length) if free[at] else []
        names = tuple(dict.fromkeys(name for slopes in wanted.values() for name, _ in slopes))
        chain = np.zeros((len(names), self.count))
        for at, slopes in wanted.items():
            for name, slope in slopes:
                chain[names.index(name), at] = slope
        return names, chain


def _slopes(p: RodProperties, group: str, k: int, length: float) -> list[tuple[str, float]]:
    """What of a rod moves with one unknown, and how much."""
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

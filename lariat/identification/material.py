"""Unknowns of a rod as one vector, their prior, and the rods that vectors stand for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod.properties import RodProperties
from lariat.rope_parameters import (
    BY_NAME,
    MATERIAL,
    RopeParameter,
    Values,
)

PROFILE_MEAN_DEVIATION = 0.02
"""Standard deviation of the mean logarithm of a profile [-]."""


@dataclass(frozen=True)
class Material:
    """Map from vectors of unknowns to rods; the vector of zeros is the prior mean."""

    mean: RodProperties
    """Prior mean, with the length of the rod at a length scale of one."""
    profile_knots: int = 1
    """Knots of the stiffness and density profiles; one for a uniform rod."""
    curvature_knots: int = 0
    """Knots of the rest curvature; zero for a rope that is straight at rest."""

    touches: bool = False
    """Whether the rope touches bodies, whose friction may be unknown."""

    parameters = MATERIAL
    """Rows of the table that may be unknown."""

    @property
    def groups(self) -> dict[str, slice]:
        """Place of the unknowns of each parameter in the vector."""
        places, at = {}, 0
        for parameter in self.parameters:
            if size := self._size(parameter):
                places[parameter.name] = slice(at, at + size)
            at += size
        return places

    def _size(self, parameter: RopeParameter) -> int:
        if parameter.name == "friction_factor" and not self.touches:
            return 0
        match parameter.values:
            case Values.SCALAR:
                # Zero and infinity have no logarithm: what is given so is not unknown.
                return int(0.0 < parameter.of(self.mean)[0] < math.inf)
            case Values.FACTORS:
                return self.profile_knots if self.profile_knots > 1 else 0
            case Values.CURVATURE:
                return 3 * self.curvature_knots
            case Values.GRIPS:
                return 6

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return max(place.stop for place in self.groups.values())

    def per_unknown(self, value: Callable[[RopeParameter], float]) -> Float64[np.ndarray, "P"]:
        """Return a vector with the value of its parameter for every unknown."""
        spread = np.zeros(self.count)
        for name, place in self.groups.items():
            spread[place] = value(BY_NAME[name])
        return spread

    def properties(self, x: Float64[np.ndarray, "P"]) -> RodProperties:
        """Return the properties of the rope of a vector."""
        values: dict[str, list[float]] = {}
        for name, place in self.groups.items():
            match BY_NAME[name].values:
                case Values.SCALAR:
                    values[name] = [getattr(self.mean, name) * math.exp(x[place][0])]
                case Values.FACTORS:
                    values[name] = np.exp(x[place]).tolist()
                case Values.CURVATURE:
                    values[name] = (x[place] / self.mean.length).tolist()
                case Values.GRIPS:
                    continue
        return self.mean.with_values(values)

    def change_per_unknown(self, name: str, value: float) -> float:
        """Return the derivative of a value with respect to its unknown [unit of the value].

        Args:
            name: Name of the parameter.
            value: Present value.
        """
        match BY_NAME[name].values:
            case Values.SCALAR | Values.FACTORS:
                return value
            case Values.CURVATURE:
                return 1.0 / self.mean.length
            case Values.GRIPS:
                return 1.0

    def prior_information(self, deviations: Float64[np.ndarray, "P"]) -> Float64[np.ndarray, "P P"]:
        """Return the inverse covariance of the prior, whose mean is zero.

        The mean of a profile is almost fixed: the stiffness or the density already scales it.

        Args:
            deviations: Standard deviation of each unknown.
        """
        information = np.diag(1.0 / deviations**2)
        for name, place in self.groups.items():
            if BY_NAME[name].values is Values.FACTORS:
                count = place.stop - place.start
                information[place, place] += 1.0 / (count * PROFILE_MEAN_DEVIATION) ** 2
        return information

    def parameter_jacobian(
        self, p: RodProperties, free: Bool[np.ndarray, "P"]
    ) -> tuple[tuple[str, ...], Float64[np.ndarray, "Q P"]]:
        """Return the names of parameters of the rod p, and their Jacobian in the free unknowns."""
        terms = [
            (at, kernel_name, self.change_per_unknown(name, value))
            for name, place in self.groups.items()
            for k, at in enumerate(range(place.start, place.stop))
            if free[at]
            for kernel_name, value in _kernel_parameters(p, BY_NAME[name], k)
        ]
        names = tuple(dict.fromkeys(name for _, name, _ in terms))
        chain = np.zeros((len(names), self.count))
        for at, name, derivative in terms:
            chain[names.index(name), at] = derivative
        return names, chain


def _kernel_parameters(
    p: RodProperties, parameter: RopeParameter, k: int
) -> list[tuple[str, float]]:
    """Return the kernels' parameters that change with the k-th unknown, and their values."""
    name = parameter.name
    match parameter.values:
        case Values.SCALAR:
            return [(scaled, getattr(p, scaled)) for scaled in parameter.scaled or (name,)]
        case Values.FACTORS:
            return [(f"{name}[{k}]", getattr(p, name)[k])]
        case Values.CURVATURE:
            return [(f"{name}[{k // 3}][{k % 3}]", getattr(p, name)[k // 3][k % 3])]
        case Values.GRIPS:
            return []

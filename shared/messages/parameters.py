"""Estimated parameters by name."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rope_parameters import PUBLISHED, RopeParameter, Values
from shared.messages.control_pb2 import Estimate, Parameters, RodParameters

XPBD_UNITS = {
    "mass": "kg",
    "inertia": "kg m^2",
    "linear_damping": "",
    "angular_damping": "",
    "bending_compliance": "m^2/N",
}
"""Units of the parameters of the paper's rod."""


@dataclass(frozen=True)
class NamedParameter:
    """Estimated or given number with its unit."""

    name: str
    """Name of the field; numbered from 1 if the field has several values."""
    value: float
    """Value [SI]."""
    standard_deviation: float
    """Standard deviation [SI]; 0 when the value is given, not estimated."""
    unit: str
    """Unit, e.g. `N m^2`."""


def named_parameters(message: Parameters) -> list[NamedParameter]:
    """Return all numbers of a message by name; values of a profile are numbered from 1."""
    rows = []
    if message.HasField("rod"):
        for parameter in PUBLISHED:
            scalar = parameter.values is Values.SCALAR
            for number, estimate in enumerate(rod_estimates(message.rod, parameter), start=1):
                name = parameter.name if scalar else f"{parameter.name}_{number}"
                deviation = estimate.standard_deviation
                rows.append(NamedParameter(name, estimate.value, deviation, parameter.unit))
    if message.HasField("xpbd"):
        for name, unit in XPBD_UNITS.items():
            rows.append(NamedParameter(name, getattr(message.xpbd, name), 0.0, unit))
    return rows


def described(name: str) -> tuple[str, str]:
    """Return words for a `NamedParameter` by its name, e.g. `grip offset, left x`, and its unit."""
    for parameter in PUBLISHED:
        number = name.removeprefix(f"{parameter.name}_")
        if name == parameter.name or number.isdecimal():
            return parameter.label(int(number) if number != name else 1), parameter.unit
    return name.replace("_", " "), XPBD_UNITS.get(name, "")


def rod_estimates(rod: RodParameters, parameter: RopeParameter) -> list[Estimate]:
    """Return all estimates of a parameter that the message has."""
    field = getattr(rod, parameter.name)
    if parameter.values is Values.SCALAR:
        return [field] if rod.HasField(parameter.name) else []
    return list(field)


def held_ends(rod: RodParameters) -> tuple[Pose, Pose]:
    """Return the poses of the rope's ends in the frames of the grips: left, right."""
    offsets, rotations = _pairs(rod.grip_offset), _pairs(rod.grip_rotation)
    left, right = (
        Pose(offset, poses.exponential(rotation))
        for offset, rotation in zip(offsets, rotations, strict=True)
    )
    return left, right


def _pairs(estimates: Sequence[Estimate]) -> Float64[np.ndarray, "2 3"]:
    """Return the vectors of both grips; zero where they are given, not estimated."""
    if not estimates:
        return np.zeros((2, 3))
    values = [e.value if e.standard_deviation > 0.0 else 0.0 for e in estimates]
    return np.reshape(values, (2, 3))

"""Parameters that a rod can be differentiated in, by name, and their codes in the kernels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import fields, replace

import numpy as np
from jaxtyping import Int64

from lariat.rod.launch.layout import PARAMETER_WIDTH, ParameterCode
from lariat.rod.properties import RodProperties

_PROFILE_CODES = {
    "stiffness_profile": ParameterCode.STIFFNESS_PROFILE,
    "density_profile": ParameterCode.DENSITY_PROFILE,
    "rest_curvature": ParameterCode.REST_CURVATURE_1,
}
"""Codes of parameters with one value for each knot, by field of `RodProperties`."""
_SCALAR_CODES = {
    code.name.lower(): code
    for code in ParameterCode
    if code.name.lower() not in {*_PROFILE_CODES, "friction"}
}
"""Codes of scalar parameters, by name."""
PARAMETERS = tuple(_SCALAR_CODES)
"""Names of scalar parameters, each varied with all others held constant.

They are those of `RodProperties`, in its units; the length varies at constant density and
stiffness. `rest_curvature_1`, `rest_curvature_2` and `rest_twist` [1/m] shift the rest curvature of
the whole rod. Beside them, `stiffness_profile[k]` [-], `density_profile[k]` [-] and
`rest_curvature[k][c]` [1/m] name single entries of `RodProperties`, and `friction[k]` [-] the
coefficient of friction of obstacle k.
"""
_FIELDS = {field.name for field in fields(RodProperties)} & {*PARAMETERS}
"""Parameters that are fields of `RodProperties`."""
_KNOT_NAME = re.compile(
    r"(stiffness_profile|density_profile|rest_curvature)\[(\d+)\](?:\[([012])\])?"
)
"""Name of a single entry of a field of `RodProperties`."""
_FRICTION_NAME = re.compile(r"friction\[(\d+)\]")
"""Name of the coefficient of friction of an obstacle."""


def parameter_codes(names: tuple[str, ...], properties: RodProperties) -> Int64[np.ndarray, "P 3"]:
    """Return code, knot and number of knots of each parameter.

    Args:
        names: Names of the parameters.
        properties: Rod whose parameters they are.

    Raises:
        ValueError: A name is not a parameter of this rod.
    """
    rows = np.zeros((len(names), PARAMETER_WIDTH), dtype=np.int64)
    for row, name in zip(rows, names, strict=True):
        knot, body = _KNOT_NAME.fullmatch(name), _FRICTION_NAME.fullmatch(name)
        if body is not None:
            row[:] = ParameterCode.FRICTION, int(body[1]), 1
        elif name in _SCALAR_CODES:
            row[:] = _SCALAR_CODES[name], 0, 1
        elif knot is None or (knot[3] is None) == (knot[1] == "rest_curvature"):
            raise ValueError(
                f"no parameter {name!r}; choose from {', '.join(PARAMETERS)}, "
                "stiffness_profile[k], density_profile[k], rest_curvature[k][c] and friction[k]"
            )
        else:
            knots = len(getattr(properties, knot[1]))
            if int(knot[2]) >= knots:
                raise ValueError(f"{knot[1]} of this rod has {knots} entries, got {name!r}")
            row[:] = _PROFILE_CODES[knot[1]] + int(knot[3] or 0), int(knot[2]), knots
    return rows


def with_parameters(properties: RodProperties, values: Mapping[str, float]) -> RodProperties:
    """Return the same rod with other values of parameters, each with all others held constant.

    Args:
        properties: Rod to change.
        values: Values by name, as in `PARAMETERS`; `rest_curvature_1`, `rest_curvature_2` and
            `rest_twist` are added to the rest curvature of the whole rod.

    Raises:
        ValueError: A name is not a parameter of this rod, or a value is out of its range.
    """
    parameter_codes(tuple(values), properties)
    for name in filter(_FRICTION_NAME.fullmatch, values):
        raise ValueError(f"{name!r} belongs to an obstacle; change its friction")
    changed = properties.with_stiffness(
        values.get("bending_stiffness", properties.bending_stiffness),
        values.get("twisting_stiffness", properties.twisting_stiffness),
    )
    profiles = {name: np.array(getattr(properties, name), float) for name in _PROFILE_CODES}
    for column, name in enumerate(("rest_curvature_1", "rest_curvature_2", "rest_twist")):
        profiles["rest_curvature"][:, column] += values.get(name, 0.0)
    for name, value in values.items():
        knot = _KNOT_NAME.fullmatch(name)
        if knot is not None:
            profiles[knot[1]][tuple(int(k) for k in knot.groups()[1:] if k is not None)] = value
    return replace(
        changed,
        **{name: value for name, value in values.items() if name in _FIELDS},
        stiffness_profile=tuple(profiles["stiffness_profile"].tolist()),
        density_profile=tuple(profiles["density_profile"].tolist()),
        rest_curvature=tuple((a, b, c) for a, b, c in profiles["rest_curvature"].tolist()),
    )

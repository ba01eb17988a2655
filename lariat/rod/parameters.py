"""Parameters that a rod can be differentiated in, by name, and their codes in the kernels."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from jaxtyping import Int64

from lariat.rod.launch.codes import Parameter
from lariat.rod.launch.layout import PARAMETER_WIDTH
from lariat.rod.properties import RodProperties

_SCALAR_CODES = {
    "bending_stiffness": Parameter.BENDING_STIFFNESS,
    "twisting_stiffness": Parameter.TWISTING_STIFFNESS,
    "stretch_stiffness": Parameter.STRETCH_STIFFNESS,
    "damping": Parameter.DAMPING,
    "internal_damping": Parameter.INTERNAL_DAMPING,
    "linear_density": Parameter.LINEAR_DENSITY,
    "length": Parameter.LENGTH,
    "rest_curvature_1": Parameter.REST_CURVATURE,
    "rest_curvature_2": Parameter.REST_CURVATURE_2,
    "rest_twist": Parameter.REST_TWIST,
}
"""Codes of scalar parameters, by name."""
PARAMETERS = tuple(_SCALAR_CODES)
"""Names of scalar parameters, each varied with all others held constant.

Units: bending_stiffness and twisting_stiffness [N m^2], stretch_stiffness [N], damping [1/s],
internal_damping [s], linear_density [kg/m], length [m] at constant density and stiffness. The last
three, [1/m], shift the rest curvature of the whole rod. Beside them, `stiffness_profile[k]` [-],
`density_profile[k]` [-] and `rest_curvature[k][c]` [1/m] name single entries of `RodProperties`.
"""

_PROFILE_CODES = {
    "stiffness_profile": Parameter.STIFFNESS_PROFILE,
    "density_profile": Parameter.DENSITY_PROFILE,
    "rest_curvature": Parameter.REST_CURVATURE,
}
"""Codes of parameters with one value for each knot, by field of `RodProperties`."""
_FIELDS = ("stretch_stiffness", "damping", "internal_damping", "linear_density", "length")
"""Parameters that are fields of `RodProperties`."""
_KNOT_NAME = re.compile(
    r"(stiffness_profile|density_profile|rest_curvature)\[(\d+)\](?:\[([012])\])?"
)
"""Name of a single entry of a field of `RodProperties`."""


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
        found = _KNOT_NAME.fullmatch(name)
        if name in _SCALAR_CODES:
            row[:] = _SCALAR_CODES[name], 0, 1
        elif found is None or (found[3] is None) == (found[1] == "rest_curvature"):
            raise ValueError(
                f"no parameter {name!r}; choose from {', '.join(PARAMETERS)}, "
                "stiffness_profile[k], density_profile[k] and rest_curvature[k][c]"
            )
        else:
            knots = len(getattr(properties, found[1]))
            if int(found[2]) >= knots:
                raise ValueError(f"{found[1]} of this rod has {knots} entries, got {name!r}")
            row[:] = _PROFILE_CODES[found[1]] + int(found[3] or 0), int(found[2]), knots
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
    changed = properties.with_stiffness(
        values.get("bending_stiffness", properties.bending_stiffness),
        values.get("twisting_stiffness", properties.twisting_stiffness),
    )
    profiles = {name: np.array(getattr(properties, name), float) for name in _PROFILE_CODES}
    for column, name in enumerate(("rest_curvature_1", "rest_curvature_2", "rest_twist")):
        profiles["rest_curvature"][:, column] += values.get(name, 0.0)
    for name, value in values.items():
        found = _KNOT_NAME.fullmatch(name)
        if found is not None:
            profiles[found[1]][tuple(int(k) for k in found.groups()[1:] if k is not None)] = value
    fields = {name: values[name] for name in _FIELDS if name in values}
    return replace(
        changed,
        **fields,
        stiffness_profile=tuple(profiles["stiffness_profile"].tolist()),
        density_profile=tuple(profiles["density_profile"].tolist()),
        rest_curvature=tuple((a, b, c) for a, b, c in profiles["rest_curvature"].tolist()),
    )

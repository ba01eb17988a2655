"""What derivatives can be taken of, by name, and how the kernels number it."""

from __future__ import annotations

import re

import numpy as np
from jaxtyping import Int64

from lariat.rod.launch.codes import Parameter
from lariat.rod.launch.layout import PARAMETER_WIDTH
from lariat.rod.properties import RodProperties

_CODES = {
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
PARAMETERS = tuple(_CODES)
"""Each with all others held: a length with the density and the stiffnesses of the material.

The last three shift the whole rod's rest shape [1/m]. Beside them, `stiffness_profile[k]`,
`density_profile[k]` and `rest_curvature[k][c]` name single entries of a `RodProperties`.
"""

_KNOT_CODES = {
    "stiffness_profile": Parameter.STIFFNESS_PROFILE,
    "density_profile": Parameter.DENSITY_PROFILE,
    "rest_curvature": Parameter.REST_CURVATURE,
}
_KNOT = re.compile(r"(stiffness_profile|density_profile|rest_curvature)\[(\d+)\](?:\[([012])\])?")


def numbered(names: tuple[str, ...], properties: RodProperties) -> Int64[np.ndarray, "P 3"]:
    """Code, knot and count of knots of each parameter.

    Raises:
        ValueError: There is no parameter of such a name.
    """
    rows = np.zeros((len(names), PARAMETER_WIDTH), dtype=np.int64)
    for row, name in zip(rows, names, strict=True):
        found = _KNOT.fullmatch(name)
        if name in _CODES:
            row[:] = _CODES[name], 0, 1
        elif found is None or (found[3] is None) == (found[1] == "rest_curvature"):
            raise ValueError(
                f"no parameter {name!r}; there are {', '.join(PARAMETERS)}, stiffness_profile[k], "
                "density_profile[k] and rest_curvature[k][c]"
            )
        else:
            knots = len(getattr(properties, found[1]))
            if int(found[2]) >= knots:
                raise ValueError(f"{found[1]} of this rod has {knots} entries, got {name!r}")
            row[:] = _KNOT_CODES[found[1]] + int(found[3] or 0), int(found[2]), knots
    return rows

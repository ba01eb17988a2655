"""The rope that the controller has learnt, from the parameters that it publishes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from lariat.rod import RodProperties


def learnt_rope(given: RodProperties, values: Mapping[str, float]) -> RodProperties:
    """The given rope with everything that is known better by now.

    Profiles come entry by entry, `stiffness_profile_1` first; rest curvature in rows of three.

    Args:
        values: By name [SI]; what is missing stays as given.
    """
    profile = _row(values, "stiffness_profile_")
    curvature = _row(values, "rest_curvature_")
    rows = np.reshape(curvature, (-1, 3)).tolist()
    ratio = values.get("twist_ratio", given.twisting_stiffness / given.bending_stiffness)
    stiffness = values.get("bending_stiffness", given.bending_stiffness)
    return replace(
        given,
        length=values.get("length", given.length),
        damping=values.get("damping", given.damping),
        stiffness_profile=tuple(profile) or given.stiffness_profile,
        rest_curvature=tuple((a, b, c) for a, b, c in rows) or given.rest_curvature,
    ).with_stiffness(stiffness, ratio * stiffness)


def _row(values: Mapping[str, float], name: str) -> list[float]:
    """Entries 1, 2, ... of a name, as far as they go."""
    found = []
    while (key := f"{name}{len(found) + 1}") in values:
        found.append(values[key])
    return found

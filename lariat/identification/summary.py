"""Summary of a fit: values with standard deviations, and properties that remain unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lariat.identification.fit import Fit
from lariat.identification.material import GROUP_UNITS, PRIOR_DEVIATIONS

MAX_DEVIATION_RATIO = 0.5
"""Ratio of posterior to prior standard deviation above which an unknown is undetermined [-]."""
MAX_CORRELATION = 0.95
"""Correlation above which two unknowns are determined only together [-]."""


@dataclass(frozen=True)
class Finding:
    """Identified value of one unknown."""

    name: str
    """Name of the group, with the index of the knot."""
    value: float
    """Value [`unit`]."""
    standard_deviation: float
    """Standard deviation of the value [`unit`]."""
    unit: str
    """SI unit."""
    known: bool
    """Whether the motion determines it."""


def findings(fit: Fit) -> list[Finding]:
    """Return every unknown with its standard deviation."""
    deviations = np.sqrt(np.diag(fit.covariance))
    p, found = fit.properties, []
    length = fit.rope_length
    for group, place in fit.material.groups.items():
        values = {
            "stiffness": [p.bending_stiffness / p.linear_density],
            "twist_ratio": [p.twisting_stiffness / p.bending_stiffness],
            "damping": [p.damping],
            "internal_damping": [p.internal_damping],
            "length": [length],
            "stiffness_profile": p.stiffness_profile,
            "density_profile": p.density_profile,
            "rest_curvature": np.ravel(p.rest_curvature),
        }[group]
        linear = group == "rest_curvature"
        for k, (value, deviation) in enumerate(zip(values, deviations[place], strict=True)):
            factor = 1.0 / fit.material.mean.length if linear else value
            name = group if len(values) == 1 else f"{group}[{k}]"
            if linear:
                name = f"{group}[{k // 3}][{k % 3}]"
            found.append(
                Finding(
                    name,
                    float(value),
                    float(deviation * factor),
                    GROUP_UNITS[group],
                    bool(deviation < MAX_DEVIATION_RATIO * PRIOR_DEVIATIONS[group]),
                )
            )
    return found


def undetermined(fit: Fit, density_known: bool = False) -> list[str]:
    """Return a sentence for each property that the motion does not determine.

    Args:
        fit: Result of a fit.
        density_known: Whether the rope's linear density is known.
    """
    sentences = (
        []
        if density_known
        else ["Mass: stiffness is found per linear density; weigh the rope to obtain EI in N m^2."]
    )
    sentences += [
        "Stretch: the rope is assumed to keep its length.",
        "Turns of twist: markers do not show the roll of the grips about the rope.",
    ]
    found = findings(fit)
    unknown = [f for f in found if not f.known]
    for group in fit.material.groups:
        of_group = [f for f in unknown if f.name.partition("[")[0] == group]
        size = len([f for f in found if f.name.partition("[")[0] == group])
        if of_group:
            which = group if size == 1 else f"{group} at {len(of_group)} of {size} places"
            sentences.append(
                f"{which.replace('_', ' ').capitalize()}: hardly determined by this motion."
            )
    deviations = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(deviations, deviations)
    for i in range(len(found)):
        for j in range(i):
            if abs(correlation[i, j]) > MAX_CORRELATION and found[i].known and found[j].known:
                sentences.append(
                    f"{found[j].name} and {found[i].name}: determined only together (correlation "
                    f"{correlation[i, j]:+.2f})."
                )
    if "rest_curvature" not in fit.material.groups:
        sentences.append("Rest curvature: without a clamped end its direction has no meaning.")
    return sentences

"""What a fit found, in words and numbers that a person can use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lariat.rod.identification.fit import Fit
from lariat.rod.identification.material import SPREADS, UNITS

UNTOLD = 0.5
"""Share of the belief's standard deviation above which the data have told nothing [-]."""
TRADED = 0.95
"""Correlation above which two unknowns can stand in for each other [-]."""


@dataclass(frozen=True)
class Finding:
    """One unknown."""

    name: str
    value: float
    standard_deviation: float
    unit: str
    known: bool
    """Whether the motion says more than was believed before."""


def findings(fit: Fit) -> list[Finding]:
    """Every unknown with its standard deviation."""
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
            factor = 1.0 / fit.material.believed.length if linear else value
            name = group if len(values) == 1 else f"{group}[{k}]"
            if linear:
                name = f"{group}[{k // 3}][{k % 3}]"
            found.append(
                Finding(
                    name,
                    float(value),
                    float(deviation * factor),
                    UNITS[group],
                    bool(deviation < UNTOLD * SPREADS[group]),
                )
            )
    return found


def cannot_tell(fit: Fit, weighed: bool = False) -> list[str]:
    """What this motion leaves open, a sentence each.

    Args:
        weighed: Whether the rope's linear density is known.
    """
    said = (
        []
        if weighed
        else ["Mass: stiffness is found per linear density; weigh the rope to have EI in N m^2."]
    )
    said += [
        "Stretch: the rope was taken to keep its length.",
        "Turns of twist: markers do not show how the grips are rolled about the rope.",
    ]
    found = findings(fit)
    blind = [f for f in found if not f.known]
    for group in fit.material.groups:
        of_group = [f for f in blind if f.name.partition("[")[0] == group]
        size = len([f for f in found if f.name.partition("[")[0] == group])
        if of_group:
            which = group if size == 1 else f"{group} at {len(of_group)} of {size} places"
            said.append(
                f"{which.replace('_', ' ').capitalize()}: as good as unseen in this motion."
            )
    deviations = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(deviations, deviations)
    for i in range(len(found)):
        for j in range(i):
            if abs(correlation[i, j]) > TRADED and found[i].known and found[j].known:
                said.append(
                    f"{found[j].name} and {found[i].name}: only together (correlation "
                    f"{correlation[i, j]:+.2f})."
                )
    if "rest_curvature" not in fit.material.groups:
        said.append("Rest curvature: without a clamped end its direction has no meaning.")
    return said

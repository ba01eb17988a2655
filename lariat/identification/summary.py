"""Summary of a fit: values with standard deviations, and properties that remain unknown."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from lariat.identification.fit import Fit
from lariat.rope_parameters import BY_NAME, Values

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
    p, rows = fit.properties, []
    for group, place in fit.material.groups.items():
        parameter = BY_NAME[group]
        values, name, unit = parameter.of(p), group, parameter.unit
        if parameter.per_density is not None:
            (name, unit), values = parameter.per_density, values / p.linear_density
        if group == "length":
            values = np.array([fit.rope_length])
        for k, (value, deviation) in enumerate(zip(values, deviations[place], strict=True)):
            index = "" if len(values) == 1 else f"[{k}]"
            if parameter.values is Values.CURVATURE:
                index = f"[{k // 3}][{k % 3}]"
            rows.append(
                Finding(
                    name + index,
                    float(value),
                    float(deviation * fit.material.change_per_unknown(group, value)),
                    unit,
                    bool(deviation < MAX_DEVIATION_RATIO * parameter.fit_prior.deviation),
                )
            )
    return rows


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
    if fit.other_grip > 0.5:
        sentences.append(
            "Grips: the motion fits held vertices of the other kind better; try --grip "
            f"{'measured' if fit.grip == 'clamped' else 'clamped'}."
        )
    if fit.frame_duration != fit.dt:
        sentences.append(
            f"Frames: with {fit.frame_duration:.4g} s between them, not {fit.dt:.4g} s, the rope "
            f"moves as gravity has it; try --dt {fit.frame_duration:.4g}."
        )
    every = findings(fit)
    for group in dict.fromkeys(f.name.partition("[")[0] for f in every):
        members = [f for f in every if f.name.partition("[")[0] == group]
        unknown = [f for f in members if not f.known]
        if unknown:
            which = (
                group
                if len(members) == 1
                else f"{group} at {len(unknown)} of {len(members)} places"
            )
            sentences.append(
                f"{which.replace('_', ' ').capitalize()}: hardly determined by this motion."
            )
    deviations = np.sqrt(np.diag(fit.covariance))
    correlation = fit.covariance / np.outer(deviations, deviations)
    for i in range(len(every)):
        for j in range(i):
            if abs(correlation[i, j]) > MAX_CORRELATION and every[i].known and every[j].known:
                sentences.append(
                    f"{every[j].name} and {every[i].name}: determined only together (correlation "
                    f"{correlation[i, j]:+.2f})."
                )
    if "rest_curvature" not in fit.material.groups:
        sentences.append("Rest curvature: without a clamped end its direction has no meaning.")
    return sentences

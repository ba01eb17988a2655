"""The rod against the continuum and closed forms: `lariat bench physics`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, groups
from benchmarks.physics import buckling, closed_forms, frequencies, friction, hanging, set, writhing
from benchmarks.physics.cases import Case
from benchmarks.physics.hanging import CLAMPED_ROPES, OTHER_ROPES
from benchmarks.plots import figure_of, save
from benchmarks.tables import Flat, Result

Part = Literal[
    "elasticae",
    "closed-forms",
    "frequencies",
    "buckling",
    "writhing",
    "friction",
    "set",
]
PARTS: dict[Part, tuple[tuple[Case, ...], str]] = {
    "elasticae": (
        hanging.ROPE_CASES,
        "ropes at rest, mean distance of nodes from the continuum at equal arc length",
    ),
    "closed-forms": (closed_forms.CASES, "shapes and moments with closed forms"),
    "frequencies": (
        frequencies.CASES,
        "natural frequencies of straight beams, against Euler-Bernoulli beams",
    ),
    "buckling": (buckling.CASES, "critical loads of straight rods and a ring"),
    "writhing": (
        writhing.CASES,
        "twisted rods that buckle, and a loop that twists round itself",
    ),
    "friction": (
        friction.CASES,
        "loads at which ropes begin to slide, and motion of a rope on a slope in 60 s",
    ),
    "set": (set.CASES, "wires that are bent round and let go, bent back, and hung up by one end"),
}
"""Cases and conditions of each table; camera and adaptation are not involved."""

SHAPES = ("0.24 m apart", "E / 4", "E x 4", "pitched", "cantilever, E x 2")
"""Plotted ropes, all in the plane y = 0."""


@dataclass(frozen=True)
class CaseSpec:
    """Case to measure."""

    part: Part
    name: str

    @property
    def case(self) -> Case:
        """The case."""
        return next(case for case in PARTS[self.part][0] if case.name == self.name)


def run(
    part: tuple[Part, ...] = get_args(Part),
    plot: Path | None = None,
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
) -> int:
    """Measure the rod's errors over its number of nodes, and compare them with their bounds.

    There is no camera or adaptation: each error is that of a rod itself with n nodes. The parts
    are: `elasticae` (hanging ropes, against boundary value solutions of the continuum),
    `closed-forms`, `frequencies`, `buckling`, `writhing`, `friction` (a slope, a post and a bar)
    and `set` (bent wires).
    The order is that of the error in the length of an edge, between the smallest and the largest
    number of nodes.

    Examples:
      lariat bench physics --plot docs/results/rod/physics.png --workers 2
      lariat bench physics --part elasticae buckling

    Args:
        part: Parts to measure; all by default.
        plot: File for a plot of shapes and errors of ropes at rest, a PNG.

    Returns:
        0 if all errors and orders are within their bounds, else 1.
    """
    specs = [CaseSpec(each, case.name) for each in part for case in PARTS[each][0]]
    trials = options.trials(run_trial, specs)
    measured = groups(trials, "part")
    tables = [Result(p, [row(t) for t in measured[p,]], PARTS[p][1]) for p in part]
    options.publish(*tables)
    broken = [t for t in trials if not t["spec"].case.held(t["errors"])]
    for trial in broken:
        spec = trial["spec"]
        print(f"{spec.part}: {spec.name}: a bound does not hold", file=sys.stderr)
    if plot is not None and "elasticae" in part:
        _draw(measured["elasticae",], plot)
    return 1 if broken else 0


def run_trial(spec: CaseSpec) -> Trial:
    """Measure a case."""
    return {"errors": spec.case.errors()}


def row(trial: Trial) -> dict[str, object]:
    """Return the row of a case: a column for each number of nodes, order and bounds."""
    case, errors = trial["spec"].case, trial["errors"]
    return {
        "case": case.name,
        "unit": case.unit,
        "bound": ", ".join(f"{bound:.2g} at {n}" for n, bound in case.bounds.items()),
        "held": case.held(errors),
        "order": case.order(errors) if case.min_order is not None else None,
        **{f"n={n}": error for n, error in zip(case.node_counts, errors, strict=True)},
    }


def _draw(trials: Sequence[Trial], path: Path) -> None:
    """Draw hanging ropes beside the continuum, and the errors of all cases, to a PNG."""
    figure, (hanging, errors) = figure_of(1, 2, (11.0, 4.5))
    for k, name in enumerate(SHAPES):
        rope = (CLAMPED_ROPES | OTHER_ROPES)[name]
        exact, nodes = rope.continuum.positions(400), rope.rest(20).state.positions
        hanging.plot(exact[:, 0], exact[:, 2], color=f"C{k}", linewidth=1.0, label=name)
        hanging.plot(nodes[:, 0], nodes[:, 2], "o", color=f"C{k}", markersize=3)
    hanging.set(xlabel="x [m]", ylabel="z [m]", aspect="equal", adjustable="datalim")
    hanging.set_title("Continuum (lines), rods of 20 nodes", fontsize=9)
    for trial in trials:
        errors.loglog(trial["spec"].case.node_counts, trial["errors"], ".-", linewidth=0.8)
    counts = np.array(trials[0]["spec"].case.node_counts, float)
    largest = max(trial["errors"][0] for trial in trials)
    errors.loglog(counts, 2.0 * largest * (counts[0] / counts) ** 2, "k--", label="2nd order")
    errors.set(xlabel="nodes", ylabel="[mm]")
    errors.set_title("Mean distance of nodes from the continuum", fontsize=9)
    save(figure, path)

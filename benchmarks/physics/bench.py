"""The rod against the continuum and closed forms: `lariat bench physics`."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, groups
from benchmarks.physics import buckling, closed_forms, frequencies, friction, hanging, set, writhing
from benchmarks.physics.cases import Case
from benchmarks.tables import Flat, Result

Part = Literal[
    "elasticae",
    "closed-forms",
    "frequencies",
    "buckling",
    "stiffness",
    "writhing",
    "plants",
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
    "stiffness": (hanging.STIFFNESS_CASES, "Young's modulus fitted to shapes of the continuum"),
    "writhing": (
        writhing.CASES,
        "twisted rods that buckle, and a loop that twists round itself",
    ),
    "plants": (
        hanging.PLANT_CASES,
        "simulated ropes at rest, mean distance of nodes from the continuum; processor time",
    ),
    "friction": (
        friction.CASES,
        "loads at which ropes begin to slide, and motion of a rope on a slope in 60 s",
    ),
    "set": (set.CASES, "wires that are bent round and let go, bent back, and hung up by one end"),
}
"""Cases and conditions of each table; camera and adaptation are not involved."""


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
    `closed-forms`, `frequencies`, `buckling`, `stiffness` (Young's modulus identified from exact
    shapes), `writhing`, `plants` (hanging ropes of the simulated lab, and their cost),
    `friction` (a slope, a post, a bar and the edge of a table) and `set` (bent wires).
    The order is that of the error in the length of an edge, between the smallest and the largest
    number of nodes.

    Examples:
      lariat bench physics --plot docs/results/rod/physics.png --workers 2
      lariat bench physics --part elasticae buckling

    Args:
        part: Parts to measure; all by default.
        plot: File for a plot of shapes and errors of ropes at rest, a PNG; that of friction is
            `friction.png` beside it.

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
    if plot is not None:
        from benchmarks.physics.plot import draw_friction, draw_ropes

        if "friction" in part:
            draw_friction(plot.with_name("friction.png"))
        if "elasticae" in part:
            draw_ropes(measured["elasticae",], plot)
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

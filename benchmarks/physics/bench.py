"""The rod against the continuum and closed forms: `lariat bench physics`."""

from __future__ import annotations

import importlib
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from benchmarks.campaign import Campaign, Workers
from benchmarks.physics.convergence import Case, Convergence, Error, measure
from benchmarks.tables import Result, publish

Part = Literal[
    "elasticae",
    "closed-forms",
    "frequencies",
    "buckling",
    "stiffness",
    "writhing",
    "whip",
    "plants",
    "friction",
    "set",
]
ALL_PARTS: tuple[Part, ...] = get_args(Part)
"""All parts, in the order of their tables; a part is the module of its name."""
CONDITIONS: dict[Part, str] = {
    "elasticae": "ropes at rest, mean distance of nodes from the continuum at equal arc length",
    "closed-forms": "shapes and moments with closed forms",
    "frequencies": "natural frequencies of straight beams, against Euler-Bernoulli beams",
    "buckling": "critical loads of straight rods and a ring",
    "stiffness": "Young's modulus fitted to shapes of the continuum",
    "writhing": "twisted rods that buckle, and a loop that twists round itself",
    "whip": "change of energy of a flicked whip, relative to its kinetic energy",
    "plants": "simulated ropes at rest, mean distance of nodes from the continuum; processor time",
    "friction": "loads at which ropes begin to slide, and motion of a rope on a slope in 60 s",
    "set": "wires that are bent round and let go, bent back, and hung up by one end",
}
"""Conditions of each table; camera and adaptation are not involved."""


@dataclass(frozen=True)
class CaseSpec:
    """Case to measure."""

    part: Part
    name: str


@dataclass(frozen=True)
class CaseTrial:
    """Measured case."""

    spec: CaseSpec
    errors: list[tuple[float, float | None]]
    """Error, and largest error of a node of a shape, for each number of nodes."""

    @property
    def convergence(self) -> Convergence:
        """Errors with the case's bounds."""
        case = cases(self.spec.part)[self.spec.name]
        return Convergence(case, tuple(Error(*error) for error in self.errors))


def run(
    part: tuple[Part, ...] = ALL_PARTS,
    results: Path | None = None,
    workers: Workers = 1,
    plot: Path | None = None,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Measure the rod's errors over its number of nodes, and compare them with their bounds.

    There is no camera or adaptation: each error is that of a rod itself with n nodes. The parts
    are: `elasticae` (hanging ropes, against boundary value solutions of the continuum),
    `closed-forms`, `frequencies`, `buckling`, `stiffness` (Young's modulus identified from exact
    shapes), `writhing`, `whip`, `plants` (hanging ropes of the simulated lab, and their cost),
    `friction` (a slope, a post, a bar and the edge of a table) and `set` (bent wires).
    The order is that of the error in the length of an edge, between the smallest and the largest
    number of nodes.

    Examples:
      lariat bench physics --plot docs/results/rod/physics.png --workers 2
      lariat bench physics --part elasticae buckling

    Args:
        part: Parts to measure; all by default.
        results: File of measured cases, one JSON object a line; cases that it holds are not
            measured again.
        workers: Number of processes, or the address of a Dask scheduler.
        plot: File for a plot of shapes and errors, a PNG; that of friction is `friction.png` beside
            it.
        json: Print one JSON object instead of tables.
        output: Folder for the tables as CSV.

    Returns:
        0 if all errors and orders are within their bounds, else 1.
    """
    specs = [CaseSpec(each, name) for each in part for name in cases(each)]
    trials = Campaign(run_trial, CaseTrial, _line).trials(specs, results, workers)
    measured = {each: [t.convergence for t in trials if t.spec.part == each] for each in part}
    tables = [
        Result(each, [row(found) for found in measured[each]], CONDITIONS[each]) for each in part
    ]
    publish(tables, json, output)
    broken = [t for t in trials if not t.convergence.held]
    for trial in broken:
        print(f"{trial.spec.part}: {trial.spec.name}: a bound does not hold", file=sys.stderr)
    if plot is not None:
        from benchmarks.physics.plot import draw, draw_friction

        if "friction" in part:
            draw_friction(plot.with_name("friction.png"))
        if part != ("friction",):
            draw(measured, plot)
    return 1 if broken else 0


def cases(part: Part) -> dict[str, Case]:
    """Return the cases of a part by their names."""
    module = importlib.import_module(f"benchmarks.physics.{part.replace('-', '_')}")
    return {case.name: case for case in module.CASES}


def run_trial(spec: CaseSpec) -> CaseTrial:
    """Measure a case."""
    return CaseTrial(spec, [*measure(cases(spec.part)[spec.name]).errors])


def _line(trial: CaseTrial) -> str:
    errors = ", ".join(f"{value:.2g}" for value, _ in trial.errors)
    return f"{trial.spec.part}: {trial.spec.name}: {errors}"


def row(found: Convergence) -> dict[str, object]:
    """Return the row of a case: a column for each number of nodes, order and bounds."""
    case = found.case
    errors = zip(case.node_counts, found.errors, strict=True)
    return {
        "case": case.name,
        "unit": case.unit,
        "bound": ", ".join(f"{bound:.2g} at {n}" for n, bound in case.bounds.items()),
        "held": found.held,
        "order": found.order if case.min_order is not None else None,
        **{f"n={n}": error.value for n, error in errors},
    }

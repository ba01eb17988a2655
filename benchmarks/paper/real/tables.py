"""Counterparts of the paper's Tables 2 and 3."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from rich.table import Table

from benchmarks.paper.real.experiments import GOALS, ROPES, ExperimentRun

PAPER_ERRORS = {"rope": (18.0, 11.0, 9.0), "cable": (10.0, 11.0, 7.0)}
"""Final mean node errors of the paper's Table 3, by rope and goal [mm]."""


def table_2(runs: Sequence[ExperimentRun]) -> Table:
    """Return the table of believed, adapted and true bending stiffness."""
    table = Table(title="Adapted stiffness, after Table 2")
    table.add_column("")
    for head in ("believed EI", "adapted EI", "true EI", "adapted / true − 1"):
        table.add_column(head if "/" in head else f"{head} \\[N m²]", justify="right")
    for run in runs:
        if not run.experiment.adapt:
            continue
        value, deviation = run.adapted_stiffness
        off = value / run.true_stiffness - 1.0
        table.add_row(
            f"{run.experiment.rope}, goal {run.experiment.goal}",
            f"{run.believed_stiffness:.2e}",
            f"({1e4 * value:.2f} ± {1e4 * deviation:.2f})e-4",
            f"{run.true_stiffness:.2e}",
            f"{100.0 * off:+.0f} %",
        )
    return table


def table_3(runs: Sequence[ExperimentRun], caption: str) -> Table:
    """Return the table of the final mean node errors [mm], beside the paper's."""
    table = Table(title="Errors \\[mm], after Table 3", caption=caption)
    for head in ("", "believed stiffness", "adapting"):
        table.add_column(head)
    goals = (f"goal {g}" for g in GOALS)
    for head in (*goals, "average", "longest time to goal", "least clearance"):
        table.add_column(head, justify="right")
    for rope in ROPES:
        rows = sorted(
            {(r.experiment.belief, r.experiment.adapt) for r in runs if r.experiment.rope == rope}
        )
        for belief, adapt in sorted(rows, key=lambda row: (not row[1], row[0])):
            same_setting = select(runs, rope, belief, adapt)
            errors = [error(r) for r in same_setting]
            times = [t for r in same_setting if (t := r.score.reached_s) is not None]
            slowest = f"{max(times):.1f} s" if len(times) == len(errors) else "not all"
            clearances = [r.score.min_clearance_mm for r in same_setting]
            least = min((c for c in clearances if c is not None), default=float("nan"))
            table.add_row(
                rope,
                f"× {belief:g}",
                "yes" if adapt else "no",
                *(f"{e:.2f}" for e in (*errors, np.mean(errors))),
                slowest,
                f"{least:.1f} mm",
            )
        paper = PAPER_ERRORS[rope]
        cells = (*(f"{e:.0f}" for e in paper), f"{np.mean(paper):.1f}")
        table.add_row(f"{rope}, paper", "", "yes", *cells, "", "")
    return table


def select(
    runs: Sequence[ExperimentRun], rope: str, belief: float, adapt: bool
) -> list[ExperimentRun]:
    """Return the runs to all goals, in the order of the goals."""
    chosen = [
        r
        for r in runs
        if (r.experiment.rope, r.experiment.belief, r.experiment.adapt) == (rope, belief, adapt)
    ]
    return sorted(chosen, key=lambda r: r.experiment.goal)


def error(run: ExperimentRun) -> float:
    """Final mean node error [mm]; infinite if the rope never moved."""
    value = run.score.final_error_mm
    return float("inf") if value is None else value

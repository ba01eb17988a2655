"""Counterparts of the paper's Tables 2 and 3, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.real.experiments import GOALS, ROPES, ExperimentRun

PAPER_ERRORS = {"rope": (18.0, 11.0, 9.0), "cable": (10.0, 11.0, 7.0)}
"""Final mean node errors of the paper's Table 3, by rope and goal [mm]."""


def table_2(runs: Sequence[ExperimentRun]) -> str:
    """Markdown table of believed, adapted and true bending stiffness."""
    lines = [
        "| | believed EI [N m²] | adapted EI [N m²] | true EI [N m²] | adapted / true − 1 |",
        "|---|---|---|---|---|",
    ]
    for run in runs:
        if not run.experiment.adapt:
            continue
        value, deviation = run.adapted_stiffness
        off = value / run.true_stiffness - 1.0
        lines.append(
            f"| {run.experiment.rope}, goal {run.experiment.goal} | {run.believed_stiffness:.2e} | "
            f"({1e4 * value:.2f} ± {1e4 * deviation:.2f})e-4 | {run.true_stiffness:.2e} | "
            f"{100.0 * off:+.0f} % |"
        )
    return "\n".join(lines)


def table_3(runs: Sequence[ExperimentRun]) -> str:
    """Markdown table of the final mean node errors [mm], beside the paper's."""
    goals = " | ".join(f"goal {g}" for g in GOALS)
    lines = [
        f"| | believed stiffness | adapting | {goals} | average | longest time to goal | "
        "least clearance |",
        "|---|---|---|" + "---|" * (len(GOALS) + 3),
    ]
    for rope in ROPES:
        rows = sorted(
            {(r.experiment.belief, r.experiment.adapt) for r in runs if r.experiment.rope == rope}
        )
        for belief, adapt in sorted(rows, key=lambda row: (not row[1], row[0])):
            same_setting = select(runs, rope, belief, adapt)
            errors = [error(r) for r in same_setting]
            times = [r.score.reached_s for r in same_setting]
            slowest = "not all" if None in times else f"{max(times):.1f} s"
            clearances = [r.score.min_clearance_mm for r in same_setting]
            least = min((c for c in clearances if c is not None), default=float("nan"))
            cells = " | ".join(f"{e:.2f}" for e in errors)
            lines.append(
                f"| {rope} | × {belief:g} | {'yes' if adapt else 'no'} | {cells} | "
                f"**{np.mean(errors):.2f}** | {slowest} | {least:.1f} mm |"
            )
        paper = PAPER_ERRORS[rope]
        cells = " | ".join(f"{e:.0f}" for e in paper)
        lines.append(f"| {rope}, paper | | yes | {cells} | {np.mean(paper):.1f} | | |")
    return "\n".join(lines)


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

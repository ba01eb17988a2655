"""Counterparts of the paper's Tables 2 and 3, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from benchmarks.real.experiments import GOALS, ROPES, Trial

PAPER_ERRORS = {"rope": (18.0, 11.0, 9.0), "cable": (10.0, 11.0, 7.0)}
"""Table 3 of the paper [mm]."""


def table_2(trials: Sequence[Trial]) -> str:
    """What the controller believed of the stiffness, what it learnt, what is true."""
    lines = [
        "| | believed EI [N m²] | adapted EI [N m²] | true EI [N m²] | off by |",
        "|---|---|---|---|---|",
    ]
    for trial in trials:
        if not trial.case.adapt:
            continue
        value, deviation = trial.adapted_stiffness
        off = value / trial.true_stiffness - 1.0
        lines.append(
            f"| {trial.case.rope}, goal {trial.case.goal} | {trial.believed_stiffness:.2e} | "
            f"({1e4 * value:.2f} ± {1e4 * deviation:.2f})e-4 | {trial.true_stiffness:.2e} | "
            f"{100.0 * off:+.0f} % |"
        )
    return "\n".join(lines)


def table_3(trials: Sequence[Trial]) -> str:
    """Mean node errors at the end of the runs [mm], the paper's beside them."""
    goals = " | ".join(f"goal {g}" for g in GOALS)
    lines = [
        f"| | believed stiffness | adapting | {goals} | average | worst time | least clearance |",
        "|---|---|---|" + "---|" * (len(GOALS) + 3),
    ]
    for rope in ROPES:
        rows = sorted({(t.case.belief, t.case.adapt) for t in trials if t.case.rope == rope})
        for belief, adapt in sorted(rows, key=lambda row: (not row[1], row[0])):
            own = chosen(trials, rope, belief, adapt)
            errors = [error(t) for t in own]
            times = [t.score.reached_s for t in own]
            slowest = "not all" if None in times else f"{max(times):.1f} s"
            clearances = [t.score.min_clearance_mm for t in own]
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


def chosen(trials: Sequence[Trial], rope: str, belief: float, adapt: bool) -> list[Trial]:
    """The runs to all goals, in their order."""
    own = [t for t in trials if (t.case.rope, t.case.belief, t.case.adapt) == (rope, belief, adapt)]
    return sorted(own, key=lambda t: t.case.goal)


def error(trial: Trial) -> float:
    """Mean node error at the end [mm]; infinite when the rope never moved."""
    value = trial.score.final_error_mm
    return float("inf") if value is None else value

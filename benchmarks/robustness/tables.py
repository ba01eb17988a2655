"""Table of a robustness campaign, as a page of the documentation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from benchmarks.robustness.combinations import Combination
from benchmarks.robustness.trial import Trial
from lariat.configuration import ConfigurationError

COLUMNS = (
    "no.",
    "scenario",
    "goal",
    "plant, n",
    "EI ×",
    "length",
    "error [mm]",
    "of the shape [mm]",
    "place known to [mm]",
    "clearance [mm]",
    "EI found / true",
    "horizon error / noise",
    "missed",
)


def write_page(
    path: Path,
    trials: Sequence[Trial],
    combinations: Sequence[Combination],
    summary: Mapping[str, float],
) -> None:
    """Write summary and table of some runs.

    Raises:
        ConfigurationError: The file cannot be written.
    """
    lines = ["# Robustness, every run", "", "Written by `lariat bench robustness`.", ""]
    lines += ["| | |", "|---|---|", *(f"| {k} | {v:.3g} |" for k, v in summary.items()), ""]
    lines += ["| " + " | ".join(COLUMNS) + " |", "|" + "---|" * len(COLUMNS)]
    lines += [_row(t, c) for t, c in zip(trials, combinations, strict=True)]
    lines += [
        "",
        "Error of the shape: mean distance of the curves, without what the rope is shifted along "
        "itself.",
        "Place known to: least standard deviation (Cramér-Rao) of the nodes along the rope, which "
        "is seen across itself at start and goal.",
        "EI found in brackets: start and goal do not tell the stiffness to 5 %.",
        "",
    ]
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text("\n".join(lines))
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error}") from error


def _row(trial: Trial, combination: Combination) -> str:
    found, deviation = trial.stiffness
    stiffness = f"{found:.2f} ± {deviation:.2f}"
    clearance = trial.score["min_clearance_mm"]
    cells = (
        str(trial.number),
        f"`{combination.scenario}`",
        combination.goal + (", rotating" if combination.rotates else ""),
        f"`{combination.plant}`, {combination.node_count}",
        f"{combination.stiffness_ratio:.2f}",
        f"{100.0 * (combination.length_ratio - 1.0):+.0f} %",
        f"{trial.error_mm:.2f}",
        f"{trial.shape_error_mm:.2f}",
        f"{trial.place_bound_mm:.2f}",
        "–" if clearance is None else f"{clearance:.1f}",
        stiffness if trial.told else f"({stiffness})",
        f"{trial.noise_ratio:.1f}",
        "; ".join(trial.faults),
    )
    return "| " + " | ".join(cells) + " |"

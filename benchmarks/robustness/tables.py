"""Table of a robustness campaign: every run with its conditions and what it missed."""

from __future__ import annotations

import csv
from collections.abc import Sequence
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


def write_table(path: Path, trials: Sequence[Trial], combinations: Sequence[Combination]) -> None:
    """Write the table of some runs as CSV.

    Raises:
        ConfigurationError: The file cannot be written.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", newline="") as stream:
            writer = csv.writer(stream, lineterminator="\n")
            writer.writerow(COLUMNS)
            writer.writerows(map(_row, trials, combinations))
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error}") from error


def _row(trial: Trial, combination: Combination) -> tuple[str, ...]:
    found, deviation = trial.stiffness
    stiffness = f"{found:.2f} ± {deviation:.2f}"
    clearance = trial.score["min_clearance_mm"]
    return (
        str(trial.number),
        combination.scenario,
        combination.goal + (", rotating" if combination.rotates else ""),
        f"{combination.plant}, {combination.node_count}",
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

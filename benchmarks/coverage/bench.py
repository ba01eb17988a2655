"""Coverage of the stated standard deviations: `lariat bench coverage`."""

from __future__ import annotations

import json as encoder
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import track
from rich.table import Table

from benchmarks import worker_pool
from benchmarks.coverage import swung_rope, trial
from benchmarks.coverage.trial import PlantModel, Stated
from benchmarks.result_block import find_block, show
from benchmarks.worker_pool import Workers

INTERVAL_DEVIATIONS = 1.645
"""Half the width of a 90 % interval, in standard deviations [-]."""
MEDIAN_DEVIATIONS = 0.6745
"""Median error, in standard deviations [-]."""
MIN_COVERAGE, MAX_COVERAGE = 0.85, 0.95
"""Least and largest share of the 90 % intervals that hold."""
MAX_WIDTH_RATIO = 2.0
"""Largest ratio of the stated standard deviation to the one of the errors [-]."""
UNITS = {
    "stiffness": ("%", 100.0),
    "damping": ("%", 100.0),
    "internal_damping": ("%", 100.0),
    "length": ("mm", 1e3),
    "grip_offset": ("mm", 1e3),
    "grip_rotation": ("deg", 180.0 / np.pi),
}
"""Unit of the errors of each group, and factor from SI units."""


class Coverage(NamedTuple):
    """Intervals of one group of numbers after some shapes."""

    group: str
    """Group of the numbers."""
    shapes: int
    """Number of shapes that had been seen."""
    intervals: int
    """Number of intervals."""
    coverage: float
    """Share of the 90 % intervals that hold [-]."""
    median_error: float
    """Median magnitude of the error [unit of the group]."""
    median_deviation: float
    """Median of the stated standard deviation [unit of the group]."""

    @property
    def width_ratio(self) -> float:
        """Stated standard deviation over the one that has the median error [-]."""
        return self.median_deviation * MEDIAN_DEVIATIONS / self.median_error

    @property
    def true(self) -> bool:
        """Whether the intervals are neither too narrow nor too wide."""
        covers = MIN_COVERAGE <= self.coverage <= MAX_COVERAGE
        return covers and self.width_ratio <= MAX_WIDTH_RATIO


def run(
    count: int = 200,
    first: int = 0,
    seed: int = 0,
    plant: tuple[PlantModel, ...] = ("rod", "mujoco", "links"),
    identify: bool = False,
    folder: Path = Path("coverage-trials"),
    again: bool = False,
    workers: Workers = 1,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Count how often the stated 90 % intervals of what is learnt hold the truth.

    Each trial hangs a rope of unknown stiffness, length and grips between four pairs of grips. Its
    nodes are seen with noise, and the controller adapts. With `--identify`, a rope is swung, and
    identified from its markers as `lariat identify` does. Finished trials are kept in
    FOLDER/trials.jsonl and are not run again.

    Examples:
      lariat bench coverage --count 100 --plant rod
      lariat bench coverage --identify --count 40

    Args:
        count: Number of trials, of which those with another plant are left out.
        first: Number of the first trial.
        seed: Seed of the trials.
        plant: Simulators of the true rope that the controller learns.
        identify: Count the intervals of the identification, not those of the controller.
        folder: Folder for finished trials.
        again: Run finished trials again.
        workers: Number of processes, or the address of a Dask scheduler.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.

    Returns:
        0 if all coverages are within 85 and 95 % and no interval is twice too wide, else 1.
    """
    block = find_block(docs)
    numbers = range(first, first + count)
    path = folder / ("identified-ropes.jsonl" if identify else "trials.jsonl")
    folder.mkdir(parents=True, exist_ok=True)
    finished = {} if again else _read(path, seed)
    if identify:
        specs = [swung_rope.sample(n, seed) for n in numbers]
        open_ones = [(spec, seed) for spec in specs if spec.number not in finished]
        computed = worker_pool.compute(swung_rope.run_trial, open_ones, workers)
    else:
        specs = [s for s in (trial.sample(n, seed) for n in numbers) if s.plant in plant]
        open_ones = [(spec, seed) for spec in specs if spec.number not in finished]
        computed = worker_pool.compute(trial.run_trial, open_ones, workers)
    console = Console(stderr=True)
    for k, stages in track(computed, "Trials", len(open_ones), console=console, transient=True):
        number = open_ones[k][0].number
        finished[number] = stages
        row = {"seed": seed, "number": number, "stages": [[asdict(s) for s in g] for g in stages]}
        with path.open("a") as file:
            file.write(encoder.dumps(row) + "\n")
    trials = [finished[spec.number] for spec in specs]
    rows = coverages([stages for stages in trials if stages])
    if json:
        print(encoder.dumps({"trials": len(trials), "coverages": [r._asdict() for r in rows]}))
    else:
        left_out = sum(not stages for stages in trials)
        show([_table(rows, len(trials), left_out)], block)
    return 0 if all(row.true for row in rows) else 1


def coverages(trials: Sequence[list[list[Stated]]]) -> list[Coverage]:
    """Return the coverage of each group, after the first and after all shapes.

    Args:
        trials: What each trial states after each shape.
    """
    rows = []
    for group, (_, factor) in UNITS.items():
        for shapes in sorted({1, *(len(stages) for stages in trials)}):
            stated = [s for stages in trials for s in stages[shapes - 1] if s.group == group]
            if not stated:
                continue
            errors = np.abs([s.error for s in stated])
            deviations = np.array([s.deviation for s in stated])
            rows.append(
                Coverage(
                    group,
                    shapes,
                    len(stated),
                    float(np.mean(errors < INTERVAL_DEVIATIONS * deviations)),
                    factor * float(np.median(errors)),
                    factor * float(np.median(deviations)),
                )
            )
    return rows


def _read(path: Path, seed: int) -> dict[int, list[list[Stated]]]:
    """Return the finished trials of a seed; a line that was cut off is left out."""
    found = {}
    for line in path.read_text().splitlines() if path.exists() else ():
        try:
            row = encoder.loads(line)
        except ValueError:
            continue
        if row["seed"] == seed:
            found[row["number"]] = [[Stated(**s) for s in stage] for stage in row["stages"]]
    return found


def _table(rows: Sequence[Coverage], count: int, left_out: int) -> Table:
    table = Table(
        "",
        "shapes",
        "intervals",
        "90 % intervals that hold",
        "median error",
        "median stated sd",
        "width / error",
        "true",
        caption=f"{count} trials, of which {left_out} left out: the plant did not come to rest",
    )
    for row in rows:
        unit = UNITS[row.group][0]
        table.add_row(
            row.group.replace("_", " "),
            str(row.shapes),
            str(row.intervals),
            f"{100.0 * row.coverage:.0f} %",
            f"{row.median_error:.2g} {unit}",
            f"{row.median_deviation:.2g} {unit}",
            f"{row.width_ratio:.2f}",
            "yes" if row.true else "no",
        )
    return table

"""Time of a headless run by process, or beside another clone: `lariat bench speed run SCENARIO`."""

from __future__ import annotations

import json as decoder
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.conditions import Conditions
from benchmarks.result_block import find_block, report
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from stack import services
from stack.scenario_overrides import load_with
from stack.simulation import closed_loop
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import SimulatedStack

ROOT = Path(__file__).parents[2]
"""Folder of this clone."""


@dataclass(frozen=True)
class ProcessTime:
    """Wall time of one process in a run; `runner` is what no process does: delivery, score."""

    process: str
    """Name of the process."""
    share_percent: float
    """Share of the run [%]."""
    ms_per_simulated_s: float
    """Time for each simulated second [ms]."""
    steps: int
    """Number of its steps."""
    step_p50_ms: float | None
    """Median of its steps [ms]."""
    step_p99_ms: float | None
    """99th percentile of its steps [ms]."""


@dataclass(frozen=True)
class Pace:
    """Real-time factors of one clone."""

    clone: str
    """Folder of the clone."""
    factors: list[float]
    """Simulated time divided by wall time of each run."""
    median: float
    """Median of them."""
    ratio: float
    """Median divided by that of the other clone."""


def run(
    scenario: Annotated[Path, tyro.conf.Positional] = Path("three-cylinders"),
    /,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
    against: Path | None = None,
    count: int = 3,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Print where the time of `lariat run` goes, by process; with --against, which clone is faster.

    With --against, this clone and another one run in turn, so that both meet the same other load.

    Examples:
      lariat bench speed run three-cylinders
      lariat bench speed run two-arms --against ../former --count 5

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        set: Replaces one value of the scenario; may be repeated.
        against: Folder of another clone.
        count: Number of runs of each clone.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
    """
    block = find_block(docs)
    loaded = load_with(scenario, set, None)
    if against:
        rows, title = paces(str(scenario), set, against.resolve(), count), ""
    else:
        rows, title = process_times(loaded)
    report(rows, str(Conditions.of(loaded)), title=title, json=json, block=block)
    return 0


def process_times(scenario: Scenario) -> tuple[list[ProcessTime], str]:
    """Run a scenario; return the time of each process, the longest first, and the run in words."""
    before: dict[str, int] = {}

    def watch(stack: SimulatedStack, scorer: Scorer) -> None:
        if not scorer.started:
            before.update({name: len(stack.step_ms(name)) for name in services.NAMES})

    outcome = closed_loop.run(scenario, watch=watch)
    score, rows = outcome.score, []
    wall = 1e3 * score.wall_s
    if not score.sim_s:
        raise ConfigurationError(f"{scenario.name}: {outcome.reason}")
    steps = {name: outcome.stack.step_ms(name)[before.get(name, 0) :] for name in services.NAMES}
    spent = {name: sum(times) for name, times in steps.items()}
    spent["runner"] = wall - sum(spent.values())
    for name, total in sorted(spent.items(), key=lambda item: -item[1]):
        p50, p99 = np.quantile(steps[name], (0.5, 0.99)) if steps.get(name) else (None, None)
        count = len(steps.get(name, ()))
        share, pace = 100.0 * total / wall, total / score.sim_s
        rows.append(ProcessTime(name, share, pace, count, p50, p99))
    return rows, f"{score.scenario}: {score.sim_s:.1f} s in {score.wall_s:.1f} s"


def paces(scenario: str, changes: tuple[str, ...], other: Path, count: int) -> list[Pace]:
    """Run a scenario in this clone and another one in turn; return the pace of both."""
    factors: dict[Path, list[float]] = {ROOT: [], other: []}
    for _ in range(count):
        for clone, found in factors.items():
            found.append(_real_time_factor(clone, scenario, changes))
    medians = {clone: float(np.median(found)) for clone, found in factors.items()}
    return [
        Pace(str(clone), factors[clone], medians[clone], medians[clone] / medians[rival])
        for clone, rival in ((ROOT, other), (other, ROOT))
    ]


def _real_time_factor(clone: Path, scenario: str, changes: tuple[str, ...]) -> float:
    command = [sys.executable, "-m", "cli", "run", scenario, "--json"]
    command += [word for change in changes for word in ("--set", change)]
    environment = {**os.environ, "PYTHONPATH": str(clone)}
    done = subprocess.run(command, cwd=clone, env=environment, capture_output=True, text=True)
    lines = [line for line in done.stdout.splitlines() if line.startswith("{")]
    if not lines:
        raise ConfigurationError(f"{clone}: {' '.join(command[1:])} fails: {done.stderr[-500:]}")
    return decoder.loads(lines[-1])["real_time_factor"]

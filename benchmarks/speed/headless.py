"""Time of a headless run by process, or beside another clone: `lariat bench speed run SCENARIO`."""

from __future__ import annotations

import json as decoder
import os
import subprocess
import sys
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import tyro

from benchmarks.conditions import Conditions
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from stack import services
from stack.simulation import closed_loop
from stack.simulation.scoring import Scorer
from stack.simulation.simulated_time import SimulatedStack

ROOT = Path(__file__).parents[2]
"""Folder of this clone."""


def run(
    scenario: Annotated[Path, tyro.conf.Positional] = Path("three-cylinders"),
    /,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
    against: Path | None = None,
    count: int = 3,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
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
    """
    loaded = load_with(scenario, set, None)
    conditions = str(Conditions.of(loaded))
    if against:
        table = Result("clones", paces(str(scenario), set, against.resolve(), count), conditions)
    else:
        rows, words = process_times(loaded)
        table = Result("processes", rows, f"{words}; {conditions}")
    options.publish(table)
    return 0


def process_times(scenario: Scenario) -> tuple[list[dict[str, Any]], str]:
    """Run a scenario; return wall times by process, the longest first, and the run in words.

    `runner` is what no process does: delivery and score.
    """
    before: dict[str, int] = {}

    def watch(stack: SimulatedStack, scorer: Scorer) -> None:
        if not scorer.started:
            before.update({name: len(stack.step_ms(name)) for name in services.NAMES})

    outcome = closed_loop.run(scenario, watch=watch)
    score = outcome.score
    wall = 1e3 * score.wall_s
    if not score.sim_s:
        raise ConfigurationError(f"{scenario.name}: {outcome.reason}")
    steps = {name: outcome.stack.step_ms(name)[before.get(name, 0) :] for name in services.NAMES}
    spent = {name: sum(times) for name, times in steps.items()}
    spent["runner"] = wall - sum(spent.values())
    rows = []
    for name, total in sorted(spent.items(), key=lambda item: -item[1]):
        p50, p99 = np.quantile(steps[name], (0.5, 0.99)) if steps.get(name) else (None, None)
        rows.append(
            {
                "process": name,
                "share_percent": 100.0 * total / wall,
                "ms_per_simulated_s": total / score.sim_s,
                "steps": len(steps.get(name, ())),
                "step_p50_ms": p50,
                "step_p99_ms": p99,
            }
        )
    return rows, f"{score.scenario}: {score.sim_s:.1f} s in {score.wall_s:.1f} s"


def paces(scenario: str, changes: tuple[str, ...], other: Path, count: int) -> list[dict[str, Any]]:
    """Run a scenario in this clone and another one in turn; return the real-time factors of both.

    `ratio` is that of the medians of a clone and the other one.
    """
    factors: dict[Path, list[float]] = {ROOT: [], other: []}
    for _ in range(count):
        for clone, measured in factors.items():
            measured.append(_real_time_factor(clone, scenario, changes))
    medians = {clone: float(np.median(measured)) for clone, measured in factors.items()}
    return [
        {
            "clone": str(clone),
            "factors": factors[clone],
            "median": medians[clone],
            "ratio": medians[clone] / medians[rival],
        }
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

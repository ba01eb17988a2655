"""Time of a headless run by process: `lariat bench speed run SCENARIO`."""

from __future__ import annotations

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


def run(
    scenario: Annotated[Path, tyro.conf.Positional] = Path("three-cylinders"),
    /,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Print where the time of `lariat run` goes, by process.

    Examples:
      lariat bench speed run three-cylinders

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        set: Replaces one value of the scenario; may be repeated.
    """
    loaded = load_with(scenario, set, None)
    rows, words = process_times(loaded)
    options.publish(Result("processes", rows, f"{words}; {Conditions.of(loaded)}"))
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

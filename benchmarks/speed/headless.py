"""Step times of a run in simulated time, by process: `lariat bench speed run SCENARIO`."""

from __future__ import annotations

import json as encoder
import time
from pathlib import Path
from typing import Annotated

import numpy as np
import tyro

from benchmarks.conditions import Conditions
from benchmarks.result_block import find_block, numbers_table, show
from stack import services
from stack.scenario_overrides import load_with
from stack.simulation import closed_loop


def run(
    scenario: Annotated[Path, tyro.conf.Positional] = Path("three-cylinders"),
    /,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Print where the time of `lariat run` goes, by process.

    For functions instead of processes, sample the run from outside: `py-spy record -- lariat run
    SCENARIO`.

    Examples:
      lariat bench speed run three-cylinders
      lariat bench speed run two-arms --set sensing.source=truth

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        set: Replaces one value of the scenario; may be repeated.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
    """
    block = find_block(docs)
    loaded = load_with(scenario, set)
    began = time.perf_counter()
    outcome = closed_loop.run(loaded)
    score = outcome.score
    rows: list[dict[str, object]] = []
    for name in services.NAMES:
        steps = np.array(outcome.stack.step_ms(name))
        if len(steps):
            p50, p99 = np.percentile(steps, (50, 99))
            rows.append(
                {
                    "process": name,
                    "ms per simulated s": round(steps.sum() / score.sim_s, 1),
                    "steps": len(steps),
                    "p50 ms": round(p50, 2),
                    "p99 ms": round(p99, 2),
                }
            )
    rows.sort(key=lambda row: -float(str(row["ms per simulated s"])))
    if json:
        print(encoder.dumps({"wall_s": score.wall_s, "sim_s": score.sim_s, "processes": rows}))
    else:
        title = (
            f"{score.scenario}: {score.sim_s:.1f} s in {score.wall_s:.1f} s, "
            f"{time.perf_counter() - began:.1f} s with the start"
        )
        show([numbers_table(title, rows, str(Conditions.of(loaded)))], block)
    return 0

"""Time by stage of a run in simulated time: `lariat bench speed run SCENARIO`."""

from __future__ import annotations

import json as encoder
import sys
from collections import Counter
from pathlib import Path
from typing import Annotated, Any

import tyro
from rich.table import Table

from benchmarks.conditions import Conditions
from benchmarks.result_block import find_block, show
from benchmarks.speed.stages.sampling import sample_command
from benchmarks.speed.stages.stages import Stage, times, within
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario
from stack import services
from stack.scenario_overrides import load_with

RUN = "stack/simulation/closed_loop.py:_drive"
"""Function whose time is that of the run: start-up and warm-up are outside of it."""
TABLE_WIDTH = 120
"""Width of the table [characters]."""


def run(
    scenario: Annotated[Path, tyro.conf.Positional] = Path("three-cylinders"),
    /,
    set: Annotated[
        tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="KEY=VALUE")
    ] = (),
    profile: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Print where the time of `lariat run` goes, by stage of the loop.

    py-spy samples the run from outside, which costs it a few percent. The profile that `--profile`
    keeps is drawn as a flame graph by speedscope.

    Examples:
      lariat bench speed run three-cylinders
      lariat bench speed run three-cylinders --profile run.speedscope.json

    Args:
        scenario: The scenario's TOML file, or the short name of a shipped one.
        set: Replaces one value of the scenario; may be repeated.
        profile: File for the sampled call stacks, in speedscope's format.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.
    """
    block = find_block(docs)
    loaded = load_with(scenario, set, None)
    changes = [word for value in set for word in ("--set", value)]
    command = [sys.executable, "-m", "cli", "run", str(scenario), "--json", *changes]
    printed, samples = sample_command(command, profile)
    score = _score(printed)
    found = times(within(samples, RUN))
    if not found or score is None:
        raise ConfigurationError(f"{scenario}: the run ended before it could be sampled")
    rows = _rows(found, score, loaded)
    if json:
        print(encoder.dumps({"score": score, "stages": rows}))
    else:
        show([_table(rows, score, loaded)], block, TABLE_WIDTH)
    return 0


def _score(printed: str) -> dict[str, Any] | None:
    lines = [line for line in printed.splitlines() if line.startswith("{")]
    return encoder.loads(lines[-1]) if lines else None


def _rows(found: Counter[Stage], score: dict[str, Any], scenario: Scenario) -> list[dict[str, Any]]:
    """One row for each stage, grouped by process, the longest first."""
    total = sum(found.values())
    # Samples are shares of the run's own clock.
    wall, simulated = score["wall_s"], score["sim_s"]
    rates = {name: services.build(name, scenario, "bench").rate for name in services.NAMES}
    by_process: Counter[str] = Counter()
    for stage, seconds in found.items():
        by_process[stage.process] += seconds
    rows = []
    for stage, seconds in sorted(
        found.items(), key=lambda item: (-by_process[item[0].process], -item[1])
    ):
        rate = scenario.sensing.rate if stage.unit == "frame" else rates.get(stage.process)
        count = simulated * rate if rate and stage.unit != "run" else None
        rows.append(
            {
                "process": stage.process,
                "stage": stage.name,
                "share": round(seconds / total, 4),
                "ms_per_simulated_s": round(1e3 * seconds / total * wall / simulated, 2),
                "us_per_unit": round(1e6 * seconds / total * wall / count) if count else None,
                "unit": stage.unit,
            }
        )
    return rows


def _table(rows: list[dict[str, Any]], score: dict[str, Any], scenario: Scenario) -> Table:
    table = Table(
        box=None,
        pad_edge=False,
        title=f"{score['scenario']}: {score['sim_s']:.1f} s in {score['wall_s']:.1f} s, sampled",
        title_justify="left",
        caption=str(Conditions.of(scenario)),
        caption_justify="left",
    )
    table.add_column("process")
    table.add_column("stage")
    for head in ("share %", "ms per simulated s", "µs", ""):
        table.add_column(head, justify="left" if not head else "right")
    shown = ""
    for row in rows:
        each = row["us_per_unit"]
        table.add_row(
            row["process"] if row["process"] != shown else "",
            row["stage"],
            f"{100.0 * row['share']:.1f}",
            f"{row['ms_per_simulated_s']:.1f}",
            "" if each is None else f"{each}",
            "" if each is None else f"per {row['unit']}",
        )
        shown = row["process"]
    return table

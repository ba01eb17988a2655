"""The paper's real experiments, with MuJoCo in place of the lab: `lariat bench paper real`.

The plant is MuJoCo's rope or cable, whose stiffness the controller believes wrong by a factor; it
is perceived through the simulated camera, with 1.5 mm of depth noise; an emulated CR5 moves the
right end. Three goals each, all of them rest shapes of the true rope, with and without adaptation:
the counterparts of the paper's Tables 2 and 3 and of Figs. 5, 8, 9 (right) and 10.
"""

from __future__ import annotations

import json as encoder
from dataclasses import asdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from benchmarks.conditions import Conditions
from benchmarks.paper.real.experiments import (
    ROPES,
    ExperimentRun,
    experiments,
    run_experiment,
    scenario,
)
from benchmarks.paper.real.tables import PAPER_ERRORS, error, table_2, table_3
from benchmarks.result_block import find_block, show

MAX_MEAN_ERROR_MM = 3.0
"""Largest mean error of a rope for which the bench succeeds [mm]."""


def run(
    beliefs: tuple[float, ...] = (0.25, 4.0),
    resolution: tuple[int, int] = (640, 480),
    depth_noise: float = 0.0015,
    time_limit: float = 15.0,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Run rope and cable to three goals each, with and without adaptation.

    Plant: MuJoCo; sensed: the simulated camera; arm: an emulated CR5. By default 24 runs, which
    take 6 minutes on one core.

    Examples:
      lariat bench paper real --docs docs/results
      lariat bench paper real --beliefs 0.25 --time-limit 5

    Args:
        beliefs: Believed stiffness relative to the true one [-].
        resolution: Width and height of the camera's images [pixels].
        depth_noise: Standard deviation of a depth pixel [m].
        time_limit: Duration of each run [s].
        docs: Folder of pages, in which the block of this command is written, with figures beside
            its page; none by default.
        json: Print one JSON object instead of the tables.

    Returns:
        0 if, with adaptation, rope and cable each average at most 3 mm, and every run reaches its
        goal and touches nothing; else 1.
    """
    block = find_block(docs)
    messages = Console(stderr=True, highlight=False)
    done: list[ExperimentRun] = []
    todo = list(experiments(beliefs))
    columns = (
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}"),
    )
    with Progress(*columns, console=messages, transient=True) as progress:
        bar = progress.add_task("", total=len(todo))
        for experiment in todo:
            progress.update(bar, description=experiment.name)
            cell = scenario(experiment, resolution, depth_noise, time_limit)
            finished = run_experiment(experiment, cell)
            done.append(finished)
            messages.print(_line(finished))
            progress.advance(bar)
    if block is not None:
        from benchmarks.paper.real.figures import draw

        for path in draw(done, block.page.parent):
            messages.print(f"wrote {path}")
    summary = _summary(done)
    if json:
        runs = [{**asdict(r.experiment), **asdict(r.score), "ended": r.reason} for r in done]
        print(encoder.dumps({"summary": summary, "paper_mm": PAPER_ERRORS, "runs": runs}))
    else:
        show(_tables(done), block)
    return 0 if summary["good"] else 1


def _line(run: ExperimentRun) -> str:
    score = run.score
    return (
        f"{run.experiment.name}: {error(run):.2f} mm, clearance {score.min_clearance_mm} mm, "
        f"within {1e3 * run.scenario.run.tolerance:g} mm after {score.reached_s} s, "
        f"{run.reason}"
    )


def _summary(runs: list[ExperimentRun]) -> dict[str, float | bool]:
    """Mean errors with and without adaptation, touches, goals reached in time."""
    summary: dict[str, float | bool] = {}
    for rope in ROPES:
        for adapt in (True, False):
            errors = [
                error(r) for r in runs if (r.experiment.rope, r.experiment.adapt) == (rope, adapt)
            ]
            key = f"{rope} {'adapting' if adapt else 'not adapting'} [mm]"
            summary[key] = round(float(np.mean(errors)), 3)
    adapting = [r for r in runs if r.experiment.adapt]
    summary["touched"] = sum(r.score.contact_time_s > 0.0 for r in runs)
    summary["in time"] = sum(r.score.reached_s is not None for r in adapting)
    summary["runs adapting"] = len(adapting)
    summary["good"] = bool(
        all(float(summary[f"{rope} adapting [mm]"]) <= MAX_MEAN_ERROR_MM for rope in ROPES)
        and not any(r.score.contact_time_s > 0.0 for r in adapting)
        and summary["in time"] == len(adapting)
    )
    return summary


def _tables(runs: list[ExperimentRun]) -> list[Table]:
    conditions = {r.experiment.rope: Conditions.of(r.scenario) for r in runs}
    plants = "; ".join(f"{rope}: {c.plant}" for rope, c in conditions.items())
    sensed = next(iter(conditions.values())).sensed
    caption = (
        f"Plant: {plants}. Sensed: {sensed}. Arm: an emulated CR5. Error: mean node distance of "
        "true rope and goal, last 0.2 s of a run."
    )
    return [table_3(runs, caption), table_2(runs)]

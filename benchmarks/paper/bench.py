"""The paper's simulations on its rod and on Lariat's: `lariat bench paper`."""

from __future__ import annotations

import json as encoder
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table

from benchmarks.paper import whole_path
from benchmarks.paper.figure_9 import draw
from benchmarks.paper.gradient_times import compare
from benchmarks.paper.studies import (
    COMPLIANCE_RATIO,
    StudyResult,
    StudyRunner,
    adaptation_studies,
    studies,
)
from benchmarks.result_block import find_block, show
from lariat.configuration import ConfigurationError

TABLE_WIDTH = 150
"""Least width of the printed tables [characters]."""


def run(
    goals: int = 10,
    seeds: int = 3,
    steps: int = 400,
    seed: int = 0,
    adaptation_goals: int = 5,
    only: tuple[str, ...] = (),
    speed: bool = True,
    plot: Path | None = None,
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Run the paper's simulations: ten goals behind three cylinders, by its methods and Lariat's.

    The methods are the paper's network, Adam on the actions, and Gauss-Newton; model and plant are
    the same rod, the paper's (xpbd) or Lariat's (direct), each with 40 nodes, whose state is known.
    The paper's online adaptation, the same goals by the whole stack, and the times of gradients by
    Taichi's reverse mode and by adjoints follow.

    Examples:
      lariat bench paper --plot docs/results/reproduction.png
      lariat bench paper --goals 2 --seeds 1 --adaptation-goals 1 --no-speed
      lariat bench paper --only mean --goals 3 --no-speed

    Args:
        goals: Number of goals.
        seeds: Number of networks with different initial weights.
        steps: Number of steps T of a run, of 10 ms each.
        seed: Seed of the goals.
        adaptation_goals: Number of goals of the adaptation studies.
        only: Words of the studies to run; all studies by default.
        speed: Whether gradients are timed.
        plot: File for the counterpart of the paper's Fig. 9, a PNG.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of tables.

    Returns:
        0 if the network on the paper's rod is as accurate as the paper says, else 1.
    """
    block = find_block(docs)
    runner = StudyRunner(seed)
    todo = [(s, goals) for s in studies(seeds)]
    todo += [(s, adaptation_goals) for s in adaptation_studies()]
    todo = [(study, count) for study, count in todo if _has_words(study.name, only)]
    whole_paths = goals if _has_words(whole_path.STUDY_NAME, only) else 0
    if not todo and not whole_paths:
        raise ConfigurationError(f"no study has all of the words {', '.join(only)}")
    results: list[StudyResult] = []
    with Progress(console=Console(stderr=True)) as bars:
        total = sum(count for _, count in todo) + whole_paths
        whole = bars.add_task("studies", total=total)
        for study, count in todo:
            done = sum(len(o.runs) for o in results)

            def report(k: int, error: float, name: str = study.name, done: int = done) -> None:
                text = f"{name}: goal {k + 1}, {1e3 * error:.1f} mm"
                bars.update(whole, completed=done + k, description=text)

            results.append(runner.run(study, count, steps, report))
            # A campaign takes minutes: results are printed as they come.
            bars.console.print(", ".join(f"{k} {v}" for k, v in results[-1].row().items()))
        scores = []
        path_goals = runner.direct_goals(whole_paths) if whole_paths else []
        for k, score in enumerate(whole_path.runs(runner.direct, path_goals, steps)):
            scores.append(score)
            done = total - whole_paths + k + 1
            bars.update(whole, completed=done, description=f"{whole_path.STUDY_NAME}: goal {k + 1}")
    times = compare(runner.xpbd, runner.direct) if speed else {}
    split = sum(result.study.softer == 1.0 for result in results)
    rows = [result.row() for result in results]
    if scores:
        rows.append(whole_path.row(scores))
    if json:
        print(
            encoder.dumps(
                {"studies": rows, "adaptation": _adaptation_rows(results), "speed": times}
            )
        )
    else:
        tables = _tables(rows, _adaptation_rows(results), times)
        show(tables, block, max(TABLE_WIDTH, Console().width))
    if plot is not None:
        draw(results[:split], results[split:], plot)
    return 0 if _reproduced(results) else 1


def _has_words(name: str, words: tuple[str, ...]) -> bool:
    return all(word in name for word in words)


def _adaptation_rows(results: list[StudyResult]) -> list[dict[str, float | str]]:
    """Prediction errors and parameters of the studies whose plant is softer than the model."""
    rows = []
    for result in results:
        if result.study.softer == 1.0:
            continue
        second_half = [
            run.prediction_errors[len(run.prediction_errors) // 2 :] for run in result.runs
        ]
        row: dict[str, float | str] = {
            "study": result.study.name,
            "prediction error, second half [mm]": round(1e3 * float(np.mean(second_half)), 4),
        }
        for name in result.runs[0].parameters:
            values = [run.parameters[name] for run in result.runs]
            row[name] = float(f"{np.mean(values):.4g}")
        if result.study.adapts:
            times = np.concatenate([run.adaptation_times for run in result.runs])
            row["adaptation p50 [ms]"] = round(1e3 * float(np.median(times)), 1)
        rows.append(row)
    return rows


def _reproduced(results: list[StudyResult]) -> bool:
    """Whether the network on the paper's rod is as accurate as the paper says, with every seed."""
    return all(
        np.mean([r.final_error for r in o.runs]) <= 0.003
        and sum(r.final_error < 0.005 for r in o.runs) >= 0.9 * len(o.runs)
        and min(r.clearance for r in o.runs) > 0.0
        for o in results
        if (o.study.method, o.study.solver, o.study.softer) == ("network", "xpbd", 1.0)
        and not o.study.mean_norm
    )


def _tables(rows: list[dict], adapted: list[dict], times: dict[str, float]) -> list[Table]:
    """Tables of the studies, of what was adapted in them, and of the times of gradients."""
    studies_caption = (
        "Plant = model, n = 40, state known (last row: Lariat's rod, true nodes sensed); "
        "not adapting unless stated. Error: mean node distance to the goal, last 0.2 s."
    )
    adapted_caption = (
        f"Plant: xpbd, n = 40, {COMPLIANCE_RATIO:g} times as soft as the model; true nodes sensed"
    )
    tables = [_table(rows, studies_caption)]
    if adapted:
        tables.append(_table(adapted, adapted_caption))
    if times:
        timed = [{"quantity": name, "value": f"{value:.4g}"} for name, value in times.items()]
        tables.append(_table(timed, "n = 40, 5 steps of 10 ms, no contact; processor time"))
    return tables


def _table(rows: list[dict], caption: str) -> Table:
    """Table whose columns are all names of the rows; a row may lack some."""
    table = Table(caption=caption)
    names = list(dict.fromkeys(name for row in rows for name in row))
    for name in names:
        table.add_column(escape(name), justify="left" if name == names[0] else "right")
    for row in rows:
        table.add_row(*(escape(str(row.get(name, ""))) for name in names))
    return table

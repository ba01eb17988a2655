"""The paper's simulations on its own rod and on ours: `lariat bench paper`."""

from __future__ import annotations

import json as encoder
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.paper import whole_path
from benchmarks.paper.figure_9 import draw
from benchmarks.paper.gradient_times import compare
from benchmarks.paper.studies import Bench, Outcome, adaptation_studies, studies


def run(
    goals: int = 10,
    seeds: int = 3,
    steps: int = 400,
    seed: int = 0,
    adaptation_goals: int = 5,
    speed: bool = True,
    plot: Path | None = None,
    json: bool = False,
) -> int:
    """The paper's ten goals behind three cylinders, by its scheme and by ours.

    Methods: its network, Adam on the actions, and Gauss-Newton; models: its rod (xpbd), which is
    then the plant as well, and the continuous one (direct). Then its online adaptation, the same
    goals by all that Lariat has, and how long gradients take by Taichi's reverse mode, which is
    the paper's way, and by adjoints.

    Args:
        goals: How many.
        seeds: First weights of the network.
        steps: T, of 10 ms.
        seed: Of the goals.
        adaptation_goals: How many of the goals the adaptation is tried on.
        speed: Whether gradients are timed.
        plot: Where figure 9 goes, as a PNG.
        json: One JSON object on standard output.
    """
    bench = Bench(seed)
    wanted = [(s, goals) for s in studies(seeds)]
    wanted += [(s, adaptation_goals) for s in adaptation_studies()]
    outcomes: list[Outcome] = []
    with Progress(console=Console(stderr=True)) as bars:
        total = sum(count for _, count in wanted) + goals
        whole = bars.add_task("studies", total=total)
        for study, count in wanted:
            done = sum(len(o.runs) for o in outcomes)

            def told(k: int, error: float, name: str = study.name, done: int = done) -> None:
                text = f"{name}: goal {k + 1}, {1e3 * error:.1f} mm"
                bars.update(whole, completed=done + k, description=text)

            outcomes.append(bench.run(study, count, steps, told))
            # A campaign takes minutes: what is known is said.
            bars.console.print(", ".join(f"{k} {v}" for k, v in outcomes[-1].row().items()))
        scores = []
        for k, score in enumerate(whole_path.runs(bench.direct, bench.direct_goals(goals), steps)):
            scores.append(score)
            done = total - goals + k + 1
            bars.update(whole, completed=done, description=f"{whole_path.NAME}: goal {k + 1}")
    times = compare(bench.xpbd, bench.direct) if speed else {}
    split = len(outcomes) - len(list(adaptation_studies()))
    rows = [*(outcome.row() for outcome in outcomes), whole_path.row(scores)]
    if json:
        print(encoder.dumps({"studies": rows, "adaptation": _adapted(outcomes), "speed": times}))
    else:
        _show(rows, _adapted(outcomes), times)
    if plot is not None:
        draw(outcomes[:split], outcomes[split:], plot)
    return 0 if _reproduced(outcomes) else 1


def _adapted(outcomes: list[Outcome]) -> list[dict[str, float | str]]:
    """What prediction errors and parameters came to where the plant is another rope."""
    rows = []
    for outcome in outcomes:
        if outcome.study.softer == 1.0:
            continue
        late = [run.prediction_errors[len(run.prediction_errors) // 2 :] for run in outcome.runs]
        row: dict[str, float | str] = {
            "study": outcome.study.name,
            "prediction error, second half [mm]": round(1e3 * float(np.mean(late)), 4),
        }
        for name in outcome.runs[0].parameters:
            values = [run.parameters[name] for run in outcome.runs]
            row[name] = float(f"{np.mean(values):.4g}")
        if outcome.study.adapts:
            times = np.concatenate([run.adaptation_times for run in outcome.runs])
            row["adapting p50 [ms]"] = round(1e3 * float(np.median(times)), 1)
        rows.append(row)
    return rows


def _reproduced(outcomes: list[Outcome]) -> bool:
    """Whether the network on the paper's rod comes as near as the paper says, with every seed."""
    return all(
        np.mean([r.final_error for r in o.runs]) <= 0.003
        and sum(r.final_error < 0.005 for r in o.runs) >= 0.9 * len(o.runs)
        and min(r.clearance for r in o.runs) > 0.0
        for o in outcomes
        if (o.study.method, o.study.solver, o.study.softer) == ("network", "xpbd", 1.0)
    )


def _show(rows: list[dict], adapted: list[dict], times: dict[str, float]) -> None:
    console = Console(width=max(150, Console().width))
    table = Table()
    for name in rows[0]:
        table.add_column(name, justify="left" if name == "study" else "right")
    for row in rows:
        table.add_row(*(str(value) for value in row.values()))
    console.print(table)
    for row in adapted:
        console.print(", ".join(f"{k} {v}" if k != "study" else str(v) for k, v in row.items()))
    for name, value in times.items():
        console.print(f"{name:55s} {value:.4g}")

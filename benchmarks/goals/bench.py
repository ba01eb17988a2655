"""Random scenes and goals, each a whole run in simulated time: `lariat bench goals`.

Every goal is a rest shape of the true rope. Rope, cylinders and limits are those of
`scenarios/three-cylinders.toml` unless the kind of scene says otherwise
(`benchmarks.goals.scenes`); the services run as in `lariat run`.
"""

from __future__ import annotations

import json as encoder
from dataclasses import replace
from itertools import groupby, product
from pathlib import Path
from typing import Literal

from rich.console import Console
from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from benchmarks.goals import campaign
from benchmarks.goals.campaign import Order, Trial
from benchmarks.goals.scenes import Kind
from shared.scenario import Scenario, load

BASE = Path(__file__).parents[2] / "scenarios" / "three-cylinders.toml"
Method = Literal["gauss_newton", "network", "actions"]


def run(
    scene: tuple[Kind, ...] = ("hard",),
    count: int = 10,
    first: int = 0,
    seed: int = 0,
    method: tuple[Method, ...] = ("gauss_newton",),
    plant: tuple[Literal["rod", "mujoco"], ...] = ("rod",),
    stiffness_error: tuple[float, ...] = (1.0,),
    youngs_modulus: float = 1.0e6,
    noise: float = 0.0,
    latency: tuple[float, ...] = (20.0,),
    sensing: Literal["truth", "camera"] = "truth",
    adapt: tuple[bool, ...] = (False,),
    planner: bool = True,
    time_limit: float = 8.0,
    workers: int = 1,
    json: bool = False,
    plots: Path | None = None,
) -> int:
    """Runs random scenes and prints error, clearance, length, time and success together.

    Options that take several values compare them on the same scenes: a row each.

    Examples:
      lariat bench goals --count 100 --workers 2
      lariat bench goals --scene boxes slot --plots pictures
      lariat bench goals --stiffness-error 0.5 1.5 6 --noise 2 --adapt True False
      lariat bench goals --latency 20 30 60 100

    Args:
        scene: Kinds of scenes.
        count: Trials of each kind and setting.
        first: Number of the first one.
        seed: Of the scenes.
        method: Of control.
        plant: What plays the true rope.
        stiffness_error: True stiffness over the one that the controller believes.
        youngs_modulus: That the controller believes [Pa].
        noise: Standard deviation of every seen node, where the truth is sensed [mm].
        latency: From exposure to image [ms].
        sensing: How the rope is seen.
        adapt: Whether the controller learns the rope.
        planner: Whether whole paths are planned.
        time_limit: Of each run [s].
        workers: Processes.
        json: One JSON object instead of a table.
        plots: Folder for a summary and a picture of every failure.
    """
    common = _common(youngs_modulus, noise, sensing, planner, time_limit)
    orders = []
    settings = product(scene, method, plant, stiffness_error, latency, adapt)
    several = {
        "scene": scene,
        "method": method,
        "plant": plant,
        "stiffness x": stiffness_error,
        "latency": latency,
        "adapt": adapt,
    }
    for values in settings:
        kind, how, who, factor, late, learns = values
        true_rope = replace(common.plant.rope, youngs_modulus=youngs_modulus * factor)
        base = replace(
            common,
            plant=replace(common.plant, model=who, rope=true_rope),
            sensing=replace(common.sensing, latency=1e-3 * late),
            control=replace(common.control, method=how, adapt=learns),
        )
        named = zip(several.items(), values, strict=True)
        variant = ", ".join(
            f"{v}" if k in ("scene", "method", "plant") else f"{k} {v}"
            for (k, choices), v in named
            if len(choices) > 1
        )
        variant = variant or kind
        orders += [Order(kind, k, seed, base, variant) for k in range(first, first + count)]
    trials = _run(orders, workers)
    groups = {name: list(group) for name, group in groupby(trials, key=lambda t: t.variant)}
    if plots:
        _draw(groups, plots)
    summaries = {name: campaign.summary(group) for name, group in groups.items()}
    if json:
        print(encoder.dumps({"summary": summaries, "trials": [t.plain() for t in trials]}))
    else:
        _print(summaries)
    return 0 if all(t.as_wanted for t in trials) else 1


def _common(
    youngs_modulus: float,
    noise: float,
    sensing: Literal["truth", "camera"],
    planner: bool,
    time_limit: float,
) -> Scenario:
    """What all trials share."""
    base = load(BASE)
    return replace(
        base,
        rope=replace(base.rope, youngs_modulus=youngs_modulus),
        sensing=replace(base.sensing, source=sensing, node_noise=1e-3 * noise),
        control=replace(base.control, planner=planner),
        run=replace(base.run, time_limit=time_limit),
    )


def _run(orders: list[Order], workers: int) -> list[Trial]:
    console = Console(stderr=True, highlight=False)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn("{task.fields[found]}"),
        TimeElapsedColumn(),
    )
    good = 0
    with Progress(*columns, console=console, redirect_stdout=False) as progress:
        bar = progress.add_task("Trials", total=len(orders), found="")

        def done(trial: Trial) -> None:
            nonlocal good
            good += trial.as_wanted
            seen = progress.tasks[0].completed + 1
            progress.update(bar, advance=1, found=f"{good} of {seen:g} as wanted")
            if not trial.as_wanted:
                progress.console.print(_line(trial))

        return campaign.run(orders, workers, done)


def _line(trial: Trial) -> str:
    score = trial.score
    return (
        f"{trial.kind}-{trial.number} ({trial.variant}): error {score.final_error_mm} mm, "
        f"clearance {score.min_clearance_mm} mm, contact {score.contact_time_s} s, "
        f"replans {score.replans}; {trial.reason}"
    )


def _print(summaries: dict[str, dict[str, float]]) -> None:
    table = Table()
    table.add_column("")
    for name in summaries:
        table.add_column(escape(name), justify="right")
    for row in next(iter(summaries.values())):
        table.add_row(escape(row), *(f"{summary[row]:g}" for summary in summaries.values()))
    Console().print(table)


def _draw(groups: dict[str, list[Trial]], folder: Path) -> None:
    from benchmarks.goals import pictures

    folder.mkdir(parents=True, exist_ok=True)
    pictures.draw_summary(dict(groups), folder / "summary.png")
    for group in groups.values():
        for trial in group:
            if not trial.as_wanted:
                setting = trial.variant.replace(" ", "-").replace(",", "")
                pictures.draw_trial(trial, folder / f"{trial.kind}-{trial.number}-{setting}.png")

"""Scenarios run, reset and run again in one stack, in simulated time: `lariat bench faults
resets`."""

from __future__ import annotations

import json as encoder
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from benchmarks.result_block import find_block, show
from lariat.scenario import Scenario
from lariat.scenario.shipped import shipped_names
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import FAILED, IDLE, REACHED, RunState, TaskRequest, TaskState, chain
from stack import services
from stack.scenario_overrides import load_with
from stack.simulation.closed_loop import POLL_PERIOD, make_ready, with_emulated_arms
from stack.simulation.simulated_time import SimulatedStack, session_id

RESET_TIMEOUT = 5 * SECOND
"""Longest simulated time that a reset may take [ns]."""
SETTLING_TIME = SECOND
"""Time between a reset and the look at the rope, which may sway a little [ns]."""


@dataclass(frozen=True)
class ResetTrial:
    """Runs of one scenario, each after a reset but the first."""

    scenario: str
    """Name of the scenario."""
    final_states: list[str]
    """State in which each run ended, with its reason unless the goal was reached."""
    errors_mm: list[float]
    """Mean node distance to the goal at the end of each run, as the controller sees it."""
    start_error_mm: float
    """Largest node distance of the true rope, after a reset, from where it hung at first."""

    @property
    def succeeded(self) -> bool:
        """Whether every run reached its goal."""
        return all(state == "reached" for state in self.final_states)


def run(
    scenario: tuple[str, ...] = (),
    runs: int = 2,
    sensing: str = "truth",
    docs: Path | None = None,
    json: bool = False,
) -> int:
    """Run scenarios several times in one stack, with a reset after each run.

    Examples:
      lariat bench faults resets
      lariat bench faults resets --scenario two-arms --runs 5 --sensing camera

    Args:
        scenario: Names of shipped scenarios; by default all of them.
        runs: Number of runs of each.
        sensing: Source of the perceived rope: truth, or camera.
        docs: Folder of pages, in which the block of this command is written; none by default.
        json: Print one JSON object instead of a table.

    Returns:
        0 if every run reached its goal, else 1.
    """
    block = find_block(docs)
    chosen = scenario or shipped_names()
    console = Console(stderr=True, highlight=False)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
    )
    trials = []
    with Progress(*columns, console=console, redirect_stdout=False) as progress:
        bar = progress.add_task("Scenarios", total=len(chosen))
        for name in chosen:
            progress.update(bar, description=name)
            loaded = load_with(Path(name), (f"sensing.source={sensing}",))
            trials.append(run_and_reset(loaded, runs))
            progress.advance(bar)
    if json:
        print(encoder.dumps({"trials": [asdict(trial) for trial in trials]}))
    else:
        show([_table(trials, sensing)], block)
    return 0 if all(trial.succeeded for trial in trials) else 1


def run_and_reset(scenario: Scenario, runs: int) -> ResetTrial:
    """Run a scenario to its goal and reset it, in one stack."""
    scenario = with_emulated_arms(scenario)
    members = tuple(services.build(n, scenario, session_id(n)) for n in services.NAMES)
    stack = SimulatedStack(members)
    stack.warm_up()
    missing = make_ready(stack, scenario)
    final_states, errors, start_error = [], [], 0.0
    if missing:
        final_states.append(missing)
    else:
        stack.advance_to(stack.now + SETTLING_TIME)
        start = _rope(stack)
        for _ in range(runs):
            _request(stack, TaskRequest.START)
            task = _wait(stack, (REACHED, FAILED), round(scenario.run.time_limit * SECOND))
            state = RunState.Name(task.state).lower()
            final_states.append(state if task.state == REACHED else f"{state}: {task.reason}")
            errors.append(round(1e3 * task.error, 3))
            _request(stack, TaskRequest.RESET)
            _wait(stack, (IDLE,), RESET_TIMEOUT)
            stack.advance_to(stack.now + SETTLING_TIME)
            gap = np.linalg.norm(_rope(stack) - start, axis=1)
            start_error = max(start_error, float(np.max(gap)))
    return ResetTrial(scenario.name, final_states, errors, round(1e3 * start_error, 3))


def _rope(stack: SimulatedStack) -> np.ndarray:
    truth = stack.latest(topics.ROPE_TRUTH)
    assert truth is not None
    return chain(truth.positions)


def _task(stack: SimulatedStack) -> TaskState:
    task = stack.latest(topics.TASK_STATE)
    assert task is not None
    return task


def _request(stack: SimulatedStack, action: TaskRequest.Action) -> None:
    request = TaskRequest(id=f"resets-{stack.now}", stamp=stack.now, action=action)
    stack.send(topics.TASK_REQUEST, request)
    # Until the request is handled the state is that of the run before.
    while _task(stack).last_request != request.id:
        stack.advance_to(stack.now + POLL_PERIOD)


def _wait(stack: SimulatedStack, states: tuple[int, ...], limit: int) -> TaskState:
    """Step until the task is in one of some states or a time has passed; its state."""
    deadline = stack.now + limit
    while stack.now < deadline:
        stack.advance_to(stack.now + POLL_PERIOD)
        if _task(stack).state in states:
            break
    return _task(stack)


def _table(trials: list[ResetTrial], sensing: str) -> Table:
    table = Table(caption=f"{sensing} sensed; errors as the controller sees them")
    for column in ("scenario", "runs", "errors mm", "start mm"):
        table.add_column(column)
    for trial in trials:
        errors = ", ".join(f"{error:.2f}" for error in trial.errors_mm)
        start = f"{trial.start_error_mm:.2f}"
        table.add_row(trial.scenario, ", ".join(trial.final_states), errors, start)
    return table

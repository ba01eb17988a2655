"""Scenarios run, reset and run again, in simulated time: `lariat bench faults resets`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.campaign import Campaign, Workers
from benchmarks.repeated_runs import RepeatedRuns
from benchmarks.tables import report
from lariat.scenario.settings import load_with
from lariat.scenario.shipped import shipped_names
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import REACHED, RunState, chain
from stack.simulation.simulated_time import SimulatedStack

SETTLING_TIME = SECOND
"""Time between a reset and the look at the rope, which may sway a little [ns]."""


@dataclass(frozen=True)
class ResetSpec:
    """Scenario, sensing and number of runs."""

    scenario: str
    """Name of a shipped scenario."""
    runs: int
    """Number of runs."""
    sensing: str
    """Source of the perceived rope: truth, or camera."""


@dataclass(frozen=True)
class ResetTrial:
    """Runs of one scenario, each after a reset but the first."""

    spec: ResetSpec
    """Specification."""
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
    results: Path | None = None,
    workers: Workers = 1,
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
        results: File of the finished scenarios, which are not run again.
        workers: Number of processes, or address of a Dask scheduler.
        json: Print one JSON object instead of a table.

    Returns:
        0 if every run reached its goal, else 1.
    """
    campaign = Campaign(run_and_reset, ResetTrial, lambda t: f"{t.spec.scenario}: {t.final_states}")
    specs = [ResetSpec(name, runs, sensing) for name in scenario or shipped_names()]
    trials = campaign.trials(specs, results, workers)
    report(trials, "errors as the controller sees them", json=json)
    return 0 if all(trial.succeeded for trial in trials) else 1


def run_and_reset(spec: ResetSpec) -> ResetTrial:
    """Run a scenario to its goal and reset it, in one stack."""
    scenario = load_with(Path(spec.scenario), (f"sensing.source={spec.sensing}",))
    try:
        cell = RepeatedRuns(scenario)
    except RuntimeError as missing:
        return ResetTrial(spec, [str(missing)], [], 0.0)
    start = _settled_rope(cell.stack)
    states, errors, start_error = [], [], 0.0
    for _ in range(spec.runs):
        task = cell.run()
        state = RunState.Name(task.state).lower()
        states.append(state if task.state == REACHED else f"{state}: {task.reason}")
        errors.append(round(1e3 * task.error, 3))
        cell.reset()
        gap = np.linalg.norm(_settled_rope(cell.stack) - start, axis=1)
        start_error = max(start_error, float(np.max(gap)))
    return ResetTrial(spec, states, errors, round(1e3 * start_error, 3))


def _settled_rope(stack: SimulatedStack) -> np.ndarray:
    """Return the nodes of the true rope after it has settled [m]."""
    stack.advance_to(stack.now + SETTLING_TIME)
    truth = stack.latest(topics.ROPE_TRUTH)
    assert truth is not None
    return chain(truth.positions)

"""Paths that lead through obstacles: the horizon goes round them, or the rope stops before them."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lariat.control.mpc import collision_avoidance
from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from services.planner.service import PlannerService
from shared import topics
from shared.messages import FAILED, TaskState
from stack import services
from stack.simulation import closed_loop
from stack.simulation.closed_loop import RunOutcome
from stack.simulation.simulated_time import session_id
from tests.closed_loop.loop import SCENARIOS


class BlindPlanner(PlannerService):
    """Planner that plans as if there were no obstacles."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        find = self._find
        self._find = lambda problem: find(replace(problem, obstacles=()))


def run_blind(seconds: float) -> RunOutcome:
    settings = ("sensing.source=truth", f"run.time_limit={seconds}")
    scenario = load_with(SCENARIOS / "three-cylinders.toml", settings)
    members = tuple(
        BlindPlanner(scenario)
        if name == "planner"
        else services.build(name, scenario, session_id(name))
        for name in services.NAMES
    )
    return closed_loop.run(scenario, members=members)


def test_horizon_goes_round_obstacles_that_the_path_leads_through() -> None:
    score = run_blind(4.0).score
    assert score.reached
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 7.0
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5


def test_rope_stops_before_an_obstacle_and_the_run_says_what_it_needs(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(collision_avoidance, "CLEARANCE_WEIGHT", 0.0)
    outcome = run_blind(6.0)
    assert outcome.score.contact_time_s == 0.0
    assert outcome.score.min_clearance_mm is not None
    assert outcome.score.min_clearance_mm > 1.0
    task = outcome.stack.latest(topics.TASK_STATE)
    assert task is not None
    assert (task.state, task.reason_code) == (FAILED, TaskState.CONTACT_EXPECTED)
    assert "mm more room" in task.reason

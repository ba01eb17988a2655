"""Limit of a plan's processor time."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lariat.planning import whole_path
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.problem import Problem, WholePath
from lariat.planning.shorter_path import stay
from lariat.planning.whole_path import PlanningTime, plan
from lariat.scenario import load

SCENARIO = Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml"


def test_time_is_over_when_the_process_has_computed_longer():
    now = 5.0
    time = PlanningTime(2.0, lambda: now)
    now = 6.9
    assert not time.is_over()
    assert not time.cut
    now = 7.1
    assert time.is_over()
    assert time.cut


def test_plan_that_runs_out_of_time_says_so(monkeypatch: pytest.MonkeyPatch):
    problem = scenario_problem(load(SCENARIO))

    def blocked(problem: Problem, clock: PlanningTime) -> WholePath:
        clock.is_over()
        return stay(problem, "blocked: a wall")

    monkeypatch.setattr(whole_path, "_plan", blocked)
    assert plan(problem).reason == "blocked: a wall"
    short = plan(replace(problem, planning_time=0.0))
    assert short.reason.startswith("blocked: a wall; ")
    assert "control.planning_time" in short.reason

"""Twist under control: both ends rotate until the rope holds the turns that its goal asks for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.rod import Rod
from lariat.scenario.rod_properties import rod_properties
from shared import topics
from shared.messages import chain
from stack.simulation.closed_loop import RunOutcome
from tests.closed_loop.loop import run


@pytest.fixture(scope="module")
def outcome() -> RunOutcome:
    return run("two-turns", "run.time_limit=5.0")


def test_a_wound_rope_takes_the_shape_of_its_turns(outcome: RunOutcome):
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 1.0
    assert score.contact_time_s == 0.0
    task = outcome.stack.latest(topics.TASK_STATE)
    assert task is not None
    assert task.turns == task.goal.turns == 2


def test_without_its_turns_the_goal_would_be_another_shape(outcome: RunOutcome):
    scenario = outcome.scorer.scenario
    rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
    untwisted = rod.rest(*scenario.grips(replace(scenario.goal, turns=0.0))).state.positions
    task = outcome.stack.latest(topics.TASK_STATE)
    assert task is not None
    goal = chain(task.goal.positions)
    assert np.mean(np.linalg.norm(goal - untwisted, axis=1)) > 0.01

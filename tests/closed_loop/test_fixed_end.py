"""One end held fast, the other on a CR5 that speaks its own protocol."""

from __future__ import annotations

import numpy as np
import pytest

from shared import topics
from shared.messages import arm_pose
from stack.simulation.closed_loop import RunOutcome
from tests.closed_loop.loop import first_difference, messages, run

NAME = "fixed-end"


@pytest.fixture(scope="module")
def outcome() -> RunOutcome:
    return run(NAME, "run.time_limit=6.0")


def test_the_arm_brings_the_rope_to_its_goal(outcome: RunOutcome):
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5
    assert score.length_error_mm < 1.0
    assert score.min_clearance_mm is None or score.min_clearance_mm > 5.0


def test_the_fixed_end_stays_where_it_was(outcome: RunOutcome):
    scenario = outcome.scorer.scenario
    arms = outcome.stack.latest(topics.ARM_STATE)
    assert arms is not None
    (start, _) = scenario.grips(scenario.start)
    assert np.allclose(arm_pose(arms, "left").position, start.position, atol=1e-9)
    assert {a.arm: a.driver for a in arms.arms} == {"left": "fixed", "right": "cr5"}


def test_client_and_emulator_in_memory_are_deterministic():
    settings = ("run.time_limit=0.6", "sensing.source=truth")
    assert first_difference(messages(NAME, *settings), messages(NAME, *settings)) == ""

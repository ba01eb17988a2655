"""A rope that is caught by something nobody has seen is not pulled on."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import Obstacle
from lariat.scenario.settings import load_with
from services.sim.service import SimService
from shared import topics
from shared.messages import FAILED
from stack import services
from stack.simulation import closed_loop
from stack.simulation.closed_loop import RunOutcome
from stack.simulation.simulated_time import session_id
from tests.closed_loop.loop import SCENARIOS

HIDDEN = Obstacle("cylinder", (0.03, 0.0, 0.4), radius=0.01, height=0.8, name="hidden")


@pytest.fixture(scope="module")
def outcome() -> RunOutcome:
    """The goal lies behind a post that only the plant knows of."""
    scenario = load_with(
        SCENARIOS / "three-cylinders.toml",
        ("obstacles=[]", "sensing.source=truth", "run.time_limit=6.0"),
    )
    members = tuple(services.build(n, scenario, session_id(n)) for n in services.NAMES)
    (sim,) = [m for m in members if isinstance(m, SimService)]
    world = sim._world
    lay = world.set_obstacles
    world.set_obstacles = lambda obstacles: lay((*obstacles, HIDDEN))
    return closed_loop.run(scenario, members=members)


def test_run_fails_with_the_place_where_the_rope_hangs(outcome: RunOutcome):
    task = outcome.stack.latest(topics.TASK_STATE)
    assert task is not None
    assert task.state == FAILED
    assert "near [0.0" in task.reason


def test_grips_stop_before_the_rope_is_stretched(outcome: RunOutcome):
    assert outcome.score.length_error_mm < 2.0
    arms = outcome.stack.latest(topics.ARM_STATE)
    assert arms is not None
    left, right = (np.array(a.position) for a in arms.arms)
    assert max(left[1], right[1]) < 0.15

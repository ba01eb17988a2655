"""The paper's rope and cable, played by MuJoCo and never as stiff as the controller believes."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.scenario import load
from lariat.scenario.rod_properties import rod_properties
from lariat.simulation.rest_shape import rest_shape
from tests.closed_loop.loop import SCENARIOS, run


@pytest.mark.parametrize("name", ["rope", "cable"])
@pytest.mark.parametrize("goal", [1, 2, 3])
def test_goals_are_rest_shapes_of_the_true_rope(name: str, goal: int):
    nodes = np.loadtxt(SCENARIOS / "goals" / f"{name}-{goal}.csv", delimiter=",")
    found = rest_shape(load(SCENARIOS / f"{name}.toml"), right=nodes[-1])
    assert np.max(np.linalg.norm(found - nodes, axis=1)) < 2e-5


def test_a_goal_that_a_stiffer_rope_could_not_take_is_reached_without_learning():
    # The planner, who believes in four times the stiffness, comes 7 mm near to it.
    outcome = run("rope", "control.adapt=false", "run.time_limit=4.0")
    assert outcome.score.reached, outcome.reason
    assert outcome.score.final_error_mm is not None
    assert outcome.score.final_error_mm < 0.6
    assert outcome.score.contact_time_s == 0.0


def test_unknown_rope_is_learnt_through_the_camera_and_reaches_its_goal() -> None:
    outcome = run("rope", "run.time_limit=5.0")
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5
    assert score.contact_time_s == 0.0
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 5.0
    # Believed to be four times as stiff.
    believed = rod_properties(outcome.scorer.scenario.rope).bending_stiffness
    stiffness, deviation = score.parameters["bending_stiffness"]
    assert 0.15 * believed < stiffness < 0.6 * believed
    assert 0.0 < deviation < 0.5 * stiffness

"""Goals that are the poses of the ends alone, with a rope that is stiffer than the model."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.geometry import polylines, poses
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.path_optimization.block_path import BLOCKS
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from shared import topics
from shared.messages import chain, goal_of
from stack.simulation import closed_loop
from tests.closed_loop.loop import SCENARIOS

STIFF = ("plant.model=rod", "plant.rope.youngs_modulus=2e6", 'sensing.source="truth"')
LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
TURNED = poses.multiply(poses.exponential(np.array([0.0, 0.0, 0.8])), LEVEL)
"""Right end that points 46° aside."""
GOAL = "goal={{line=[[-0.17, 0.15, 0.24], [0.17, 0.12, 0.22]], {more}}}"


def cell(more: str, *settings: str) -> Scenario:
    given = (GOAL.format(more=more), "obstacles=[]", *STIFF, *settings)
    return load_with(SCENARIOS / "three-cylinders.toml", given)


def ends_error(outcome: closed_loop.RunOutcome) -> float:
    """Mean distance of the true rope's ends from those of the goal [m]."""
    rope = outcome.stack.latest(topics.ROPE_TRUTH)
    state = outcome.stack.latest(topics.TASK_STATE)
    assert rope is not None
    assert state is not None
    nodes, goal = chain(rope.positions), chain(state.goal.positions)
    return polylines.mean_node_distance(nodes[[0, -1]], goal[[0, -1]])


def test_ends_are_met_whatever_shape_a_rope_twice_as_stiff_takes() -> None:
    free = closed_loop.run(cell("ends_only=true"), stop_after=1.5)
    assert free.score.reached, free.reason
    assert ends_error(free) < 1e-4
    assert free.score.final_angle_rad == 0.0  # Neither end rotates.
    assert 1e-3 * (free.score.final_error_mm or 0.0) == pytest.approx(ends_error(free), abs=2e-5)
    state = free.stack.latest(topics.TASK_STATE)
    assert state is not None
    assert goal_of(state.goal).counted.sum() == 2
    # The same ends with the model's shape between them: the ends give way for the shape.
    shaped = closed_loop.run(cell("ends_only=false"), stop_after=1.5)
    assert ends_error(shaped) > 1e-3


def test_an_end_that_rotates_comes_to_its_orientation() -> None:
    turned = f"ends_only=true, right_orientation={TURNED.tolist()}"
    outcome = closed_loop.run(cell(turned, "ends.right.rotates=true"), stop_after=1.5)
    assert outcome.score.reached, outcome.reason
    assert outcome.score.final_angle_rad is not None
    assert outcome.score.final_angle_rad < 0.01
    assert ends_error(outcome) < 3e-4
    rope = outcome.stack.latest(topics.ROPE_TRUTH)
    state = outcome.stack.latest(topics.TASK_STATE)
    assert rope is not None
    assert state is not None
    goal = goal_of(state.goal)
    assert state.angle_error == pytest.approx(goal.angle(chain(rope.positions)), abs=5e-3)
    assert goal.angle(np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0]])) > 0.7


def test_plan_is_judged_by_the_ends_alone() -> None:
    problem = scenario_problem(cell("ends_only=true"))
    bent = problem.goal.nodes.copy()
    bent[1:-1, 2] -= 0.05
    assert problem.goal_error(bent) < 1e-12
    shifted = problem.goal.nodes + np.array([0.0, 0.002, 0.0])
    assert problem.goal_error(shifted) == pytest.approx(0.002)
    away = problem.with_goal(nodes=bent)
    found = PathOptimizer(away)
    straight = found.translated(np.zeros((BLOCKS, 2, 3)))
    best = found.refine(straight, 12)
    assert best.error < 1e-4


def test_ends_go_with_a_line() -> None:
    with pytest.raises(ConfigurationError, match=r"ends_only.*line"):
        load_with(SCENARIOS / "rope.toml", ['goal={nodes="goal.csv", ends_only=true}'])

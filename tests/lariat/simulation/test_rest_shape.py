"""Rest shapes of the true rope, between the grips that the ends can take."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lariat.control.run.goals import GoalFactory
from lariat.rod import Rod
from lariat.scenario import load
from lariat.scenario.rod_properties import rod_properties
from lariat.scenario.settings import load_with
from lariat.simulation.rest_shape import goal_grips, rest_shape

EQUAL = ("plant.model=rod", "plant.rope.node_count=40")


def test_an_end_that_does_not_rotate_keeps_the_direction_of_the_start() -> None:
    scenario = load_with(Path("three-cylinders"), EQUAL)
    nodes = rest_shape(scenario)
    goals = GoalFactory(scenario, _rod(scenario), scenario.grips(scenario.start))
    np.testing.assert_allclose(nodes, goals.from_shape(scenario.goal).nodes, atol=2e-5)


def test_a_goal_with_turns_is_the_shape_of_a_wound_rope() -> None:
    scenario = load_with(Path("two-turns"), EQUAL)
    nodes = rest_shape(scenario)
    goals = GoalFactory(scenario, _rod(scenario), scenario.grips(scenario.start))
    np.testing.assert_allclose(nodes, goals.from_shape(scenario.goal).nodes, atol=2e-4)


def test_a_fixed_end_of_a_goal_stays_where_it_starts() -> None:
    scenario = load("fixed-end")
    left, _ = goal_grips(scenario)
    np.testing.assert_array_equal(left.position, scenario.grips(scenario.start)[0].position)


def _rod(scenario) -> Rod:
    return Rod(rod_properties(scenario.rope), scenario.rope.node_count)


def test_a_rope_lies_over_its_support_also_in_another_simulator() -> None:
    scenario = load_with(Path("over-a-bar"), ("plant.rope.node_count=60",))
    nodes = rest_shape(scenario)
    bar = next(body for body in scenario.bodies if body.support)
    nearest = np.argmin(np.abs(nodes[:, 0] - bar.position[0]))
    assert nodes[nearest, 2] > bar.position[2] + bar.radius

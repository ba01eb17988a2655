"""The cell of `two-arms` with one post, for the tests of arms in the plan."""

from __future__ import annotations

from dataclasses import replace

from lariat.planning.cell_problem import scenario_problem
from lariat.planning.problem import Problem
from lariat.scenario import Scenario, load
from lariat.scenario.sections import Obstacle
from lariat.scenario.shipped import find

IN_THE_WAY = Obstacle(
    "cylinder", (-0.3, -0.12, 0.15), radius=0.03, height=0.3, name="beside the wrist"
)
"""Post that the rope passes, and that a link of the left arm hits on the rope's usual way."""
AT_THE_GOAL = Obstacle(
    "cylinder", (-0.42, 0.0, 0.15), radius=0.03, height=0.3, name="under the arm"
)
"""Post where a link of the left arm is while the goal is held."""


def cell_with(*obstacles: Obstacle) -> Scenario:
    """The cell with other obstacles."""
    return replace(load(find("two-arms")), obstacles=obstacles)


def two_arms(*obstacles: Obstacle) -> Problem:
    """Planning problem of `two-arms` with other obstacles."""
    return scenario_problem(cell_with(*obstacles))

"""Planning problem of a scenario, from its start to its goal."""

from __future__ import annotations

import numpy as np

from lariat.geometry import polylines
from lariat.geometry.obstacles import pack
from lariat.rod import Rod, add_turns
from services.controller.run.goals import GoalFactory
from services.planner.problem import Problem
from services.planner.service import PlannerService
from shared.scenario import Scenario
from shared.scenario.rod_properties import rod_properties


def scenario_problem(scenario: Scenario) -> Problem:
    """Return the problem that the planner solves when a run of the scenario starts.

    Raises:
        ValueError: The rope has no shape at rest at the start or at the goal.
    """
    rope, start = scenario.rope, scenario.start
    rod = Rod(rod_properties(rope), rope.node_count)
    grips = scenario.grips(start)
    supports = [body for body in scenario.bodies if body.support]
    packed = pack(supports) if supports else None
    state = rod.rest(*grips, obstacles=packed).state
    if start.turns:
        guess = add_turns(state, round(start.turns))
        state = rod.rest(*grips, guess=guess, obstacles=packed).state
    goal = GoalFactory(scenario, rod, grips).from_shape(scenario.goal)
    nodes = np.asarray(goal.nodes)
    if len(nodes) != rope.node_count:
        nodes = polylines.resample_smooth(nodes, rope.node_count)
    return PlannerService(scenario).problem(
        state,
        grips,
        nodes,
        (goal.left, goal.right),
        scenario.bodies,
        (goal.left_oriented, goal.right_oriented),
        round(goal.turns),
    )

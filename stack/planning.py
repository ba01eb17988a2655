"""Planning problem of a scenario, from its start to its goal."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.control.run.goals import GoalFactory
from lariat.geometry import polylines
from lariat.geometry.obstacles import pack_supports
from lariat.planning.moving_obstacles import Departure, divided, plan_departure
from lariat.planning.problem import Problem
from lariat.planning.whole_path import plan
from lariat.rod import Rod, add_turns
from lariat.scenario import Scenario
from lariat.scenario.rod_properties import rod_properties
from services.planner.service import PlannerService


def scenario_problem(scenario: Scenario) -> Problem:
    """Return the problem that the planner solves when a run of the scenario starts.

    Obstacles that move in the run are left out; `scenario_departure` keeps clear of them.

    Raises:
        ValueError: The rope has no shape at rest at the start or at the goal.
    """
    rope, start = scenario.rope, scenario.start
    rod = Rod(rod_properties(rope), rope.node_count)
    grips = scenario.grips(start)
    packed = pack_supports(scenario.bodies)
    state = rod.rest(*grips, obstacles=packed).state
    if start.turns:
        guess = add_turns(state, round(start.turns))
        state = rod.rest(*grips, guess=guess, obstacles=packed).state
    goal = GoalFactory(scenario, rod, grips).from_shape(scenario.goal)
    if len(goal.nodes) != rope.node_count:
        goal = replace(goal, nodes=polylines.resample_smooth(goal.nodes, rope.node_count))
    still, _ = divided(scenario.bodies, scenario.obstacle_motions(), 0.0)
    # The rest of the rope has been fitted to a part that counts.
    return PlannerService(scenario).problem(state, grips, replace(goal, part=None), still)


def scenario_departure(scenario: Scenario, problem: Problem) -> Departure:
    """Return the path on which a run of the scenario departs, in seconds after its start.

    Args:
        scenario: Scenario.
        problem: Its problem.
    """
    _, moving = divided(scenario.bodies, scenario.obstacle_motions(), 0.0)
    if not moving:
        return Departure(plan(problem), 0.0, np.inf)
    return plan_departure(problem, moving, 0.0, plan)

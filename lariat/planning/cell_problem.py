"""Planning problems of a scenario: of any two shapes, and from its start to its goal."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from lariat.control.estimation.material_filter import MaterialFilter
from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.control.run.goals import GoalFactory
from lariat.geometry import polylines
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.planning.certain_clearance import drawn_ropes
from lariat.planning.moving_obstacles import Departure, divided, plan_departure
from lariat.planning.problem import Problem
from lariat.planning.rope_model import RopeModel
from lariat.planning.whole_path import plan
from lariat.rod import RodState
from lariat.scenario import SIDES, Goal, Scenario

if TYPE_CHECKING:
    from lariat.planning.arms.cell_arms import CellArms


def problem_of(
    scenario: Scenario,
    rope: RopeModel,
    state: RodState,
    grips: tuple[Pose, Pose],
    goal: Goal,
    obstacles: Sequence[Obstacle],
    arms: CellArms | None = None,
    replan_count: int = 0,
) -> Problem:
    """Return the planning problem of a scenario's cell from one shape to another.

    Args:
        scenario: Limits, tolerances and regions of the cell.
        rope: The rope.
        state: Rope at rest between the grips.
        grips: Poses of the rope's ends at the start.
        goal: Goal, of which the whole shape counts, or the ends alone.
        obstacles: Obstacles of the scene, supports among them. The regions that the scenario keeps
            the rope in join them.
        arms: Arms of the cell with their joints; those of the scenario's start if None.
        replan_count: Number of requests for another path; each tries other random paths.
    """
    return Problem(
        rod=rope.rod,
        state=state,
        grips=grips,
        goal=goal,
        moves=scenario.moves,
        variants=rope.variants,
        drawn=rope.drawn,
        held=rope.held,
        obstacles=(*(o for o in obstacles if not o.support), *scenario.regions),
        supports=tuple(o for o in obstacles if o.support),
        limits=scenario.limits,
        clearance=scenario.control.clearance,
        tolerance=scenario.run.tolerance,
        angle_tolerance=scenario.run.angle_tolerance,
        seed=scenario.seed + replan_count,
        planning_time=scenario.control.planning_time,
        arms=arms or arms_of(scenario),
    )


def arms_of(scenario: Scenario) -> CellArms | None:
    """Return the arms of a scenario; None where no end has one."""
    if all(scenario.end(side).driver in ("fixed", "ideal") for side in SIDES):
        return None
    # Only a cell with arms needs Pinocchio.
    from lariat.planning.arms.cell_arms import CellArms

    return CellArms.of(scenario)


def scenario_problem(scenario: Scenario) -> Problem:
    """Return the problem that the planner solves when a run of the scenario starts.

    Obstacles that move in the run are left out; `scenario_departure` keeps clear of them. A rope
    that is learned in the run counts as known as little as before it.

    Raises:
        ValueError: The rope has no shape at rest at the start or at the goal.
    """
    rope, start = scenario.rope, scenario.start
    model, grips = RopeModel(rope, scenario.moves), scenario.grips(start)
    if scenario.control.adapt:
        unknowns, known = RopeUnknowns.of(model.given), MaterialFilter(model.given).distribution
        model.drawn = drawn_ropes(model.rod, unknowns, *known, seed=scenario.seed)
    state = model.rest_state(grips, None, scenario.bodies, round(start.turns or 0))
    goal = GoalFactory(scenario, model.rod, grips).from_shape(scenario.goal)
    if len(goal.nodes) != rope.node_count:
        goal = replace(goal, nodes=polylines.resample_smooth(goal.nodes, rope.node_count))
    still, _ = divided(scenario.bodies, scenario.obstacle_motions(), 0.0)
    # The rest of the rope has been fitted to a part that counts.
    return problem_of(scenario, model, state, grips, replace(goal, part=None), still)


def scenario_departure(scenario: Scenario, problem: Problem) -> Departure:
    """Return the path on which a run of the scenario departs, in seconds after its start."""
    _, moving = divided(scenario.bodies, scenario.obstacle_motions(), 0.0)
    if not moving:
        return Departure(plan(problem), 0.0, np.inf)
    return plan_departure(problem, moving, 0.0, plan)

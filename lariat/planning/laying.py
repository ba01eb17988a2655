"""Laying: a path to a goal with a route, along which the rope is laid stop by stop.

The rope is brought to where it hangs over the first clip, by the searches, and from there along the
waypoints of `lariat.rod.cable_laying`, simulated with its contact, friction and set.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from lariat.geometry.cable_routes import clip_names, clip_openings, held_clips, stops_of
from lariat.geometry.grips import Grips
from lariat.planning.arms.arm_check import arm_fault
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import path_through
from lariat.planning.shorter_path import stay
from lariat.planning.time_parameterization import Pace
from lariat.rod import state_along
from lariat.rod.cable_laying import laying

LAYING_SHARE = 0.2
"""Share of the usual limits on motion that laying uses [-]."""
LAYING_PACE = Pace(1.3, (0.16, 0.1))
"""Pace of laying: an end has to swing to a clip before it is lowered, so that corners are sharp."""


def plan_laying(problem: Problem, approach: Callable[[Problem], WholePath]) -> WholePath:
    """Return a path that lays the rope along the route of the goal, after an approach to it."""
    goal, bodies = problem.goal, problem.solid
    grips = problem.feasible_goal_grips
    ends = np.array([grip.position for grip in grips])
    try:
        stops = stops_of(goal.route, bodies, ends, problem.radius)
        rotates = problem.moves[:, 3:].any(axis=1)
        state, waypoints = laying(
            problem.rod, stops, grips, (bool(rotates[0]), bool(rotates[1])), bodies
        )
    except ValueError as error:
        return stay(problem, f"unreachable: {error}")
    left, right = waypoints.pair(0)
    hanging = problem.with_goal(nodes=state.positions, left=left, right=right, route=())
    above = approach(hanging)
    if not above.reached:
        return above
    left, right = above.pair(-1)
    guess = replace(
        state_along(above.nodes[-1], left.orientation, right.orientation),
        plastic_curvature=problem.state.plastic_curvature,
    )
    begin = problem.rod.rest(left, right, guess=guess, obstacles=problem.packed_supports).state
    down = path_through(
        replace(problem, state=begin, grips=(left, right), pace=LAYING_SHARE * problem.pace),
        Grips.joined(above[-1:], waypoints[1:]),
        LAYING_PACE,
    )
    path = down.after(above)
    held = held_clips(goal.route, bodies, path.nodes[-1])
    lost = [name for name in clip_names(goal.route) if name not in held]
    reason = path.reason
    if lost:
        miss = clip_openings(bodies)[lost[0]].miss(path.nodes[-1])
        reason = f"the rope does not come to lie in clip {lost[0]!r}: it {miss}"
    reason = reason or str(arm_fault(problem, path) or "")
    if not reason:
        return path
    return replace(path, reached=False, reason=f"blocked: while it is laid, {reason}")

"""Landing: a rope that comes to rest above its support, and is then lowered onto it.

Friction, which the rod lacks, holds a rope where it first lies. A rope that swings onto a support,
or that slides along it, therefore stays beside its goal. Above the support it hangs freely and
comes to rest where the rod does. From there it is lowered so that the points that lie on the
support at the goal come straight down: they touch it where they lie, and need not slide.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.obstacles import scene_distance
from lariat.geometry.poses import Pose
from lariat.planning.path_optimization.block_path import BLOCKS, STEP_TIME
from lariat.planning.path_optimization.optimizer import PathOptimizer
from lariat.planning.problem import Problem, WholePath
from lariat.planning.retiming import retime
from lariat.planning.time_parameterization import Pace
from lariat.rod import RodState, RolloutSpec

LEANING_CLEARANCE = 0.003
"""Distance of a point of the goal from a support below which it leans on it [m]."""
HOVER_CLEARANCE = 0.012
"""Distance from the supports at which the rope comes to rest before it is lowered [m]."""
LIFT_STEP = 0.0025
"""Distance between the heights of the grips that are computed [m]."""
MAX_LIFT = 0.25
"""Largest height of the grips above those of the goal [m]."""
FIT_ITERATIONS = 5
"""Largest number of Gauss-Newton iterations that fit the grips to the goal's nodes."""
SHIFT_ITERATIONS = 10
"""Number of iterations that find the horizontal positions of the grips at each height."""
DESCENT_SPEED_SHARE = 0.5
"""Share of the usual limits on motion that the descent uses [-]."""
DESCENT_PACES = (Pace(1.3, (0.16, 0.1)),)
"""Pace of the descent: ends that go aside only once the rope lies must not begin before, so that
corners are sharp."""


def plan_landing(problem: Problem, approach: Callable[[Problem], WholePath]) -> WholePath | None:
    """Return a path to above the supports of the goal, and the descent onto them from there.

    Args:
        approach: Planner of the first part.

    Returns:
        The path; None where the goal leans on nothing, where an end cannot be moved, or where the
        rope does not come free of its supports when it is lifted.
    """
    if not problem.supports or not problem.moves[:, :3].all():
        return None
    leaning = _height(problem, problem.goal.nodes) < LEANING_CLEARANCE
    lying = _lying(problem) if leaning.any() else None
    if lying is None:
        return None
    state, (left, right) = lying
    offsets, lifted = _lifted(problem, state, leaning)
    free = np.min(_height(problem, lifted), axis=1) >= HOVER_CLEARANCE
    if not free.any():
        return None
    top = int(np.argmax(free))
    ends = np.stack([left.position, right.position])
    descent = np.concatenate([ends + offsets[top::-1, None], ends[None]])
    above = Pose(descent[0, 0], left.orientation), Pose(descent[0, 1], right.orientation)
    hovering = problem.rest(above, lifted[top], problem.goal.turns)
    path = approach(problem.with_goal(nodes=hovering.positions, left=above[0], right=above[1]))
    return _lowered(problem, path, descent) if path.reached else path


def _lowered(
    problem: Problem, approach: WholePath, descent: Float64[np.ndarray, "w 2 3"]
) -> WholePath:
    """Path that goes on from above the supports, along positions of the rope's ends [m]."""
    above, turned = approach.pair(-1), problem.feasible_goal_grips
    left, right = (Pose(p, grip.orientation) for p, grip in zip(descent[-1], turned, strict=True))
    lowering = replace(
        problem.with_goal(left=left, right=right),
        state=problem.rest(above, approach.nodes[-1], problem.goal.turns),
        grips=above,
        pace=DESCENT_SPEED_SHARE * problem.pace,
    )
    optimizer = PathOptimizer(lowering)
    at = np.linspace(0.0, len(descent) - 1.0, BLOCKS + 1)
    columns = descent.reshape(-1, 6).T
    waypoints = np.stack([np.interp(at, np.arange(len(descent)), c) for c in columns], axis=1)
    waypoints = waypoints.reshape(-1, 2, 3)
    # The approach may end a little beside its goal.
    share = np.linspace(1.0, 0.0, len(waypoints))[:, None, None]
    waypoints = waypoints + share * (approach.positions[-1] - waypoints[0])
    candidate = optimizer.translated(np.diff(waypoints, axis=0))
    return retime(optimizer, candidate, paces=DESCENT_PACES).after(approach)


def _lying(problem: Problem) -> tuple[RodState, tuple[Pose, Pose]] | None:
    """Rod at rest on the supports where it is nearest to the goal, and the poses of its ends."""
    goal, grips = problem.goal, problem.feasible_goal_grips
    try:
        state = problem.rest(grips, goal.nodes, goal.turns)
    except ValueError:
        # The goal's grips are further apart than the rope is long.
        return None
    near = PathOptimizer(replace(problem, state=state, grips=grips))
    fitted = near.follow(np.zeros((BLOCKS, 2, 6)))
    fitted = near.refine(fitted, FIT_ITERATIONS)
    return fitted.final, near.grips(fitted).pair(-1)


def _lifted(
    problem: Problem, state: RodState, leaning: Bool[np.ndarray, "n"]
) -> tuple[Float64[np.ndarray, "k 3"], Float64[np.ndarray, "k n 3"]]:
    """Rope that is lifted so that its leaning points go straight up.

    Returns:
        Displacement of both ends [m] and nodes [m] at each height.
    """
    count = round(MAX_LIFT / LIFT_STEP)
    offsets = np.zeros((count + 1, 3))
    offsets[:, 2] = LIFT_STEP * np.arange(count + 1)
    nodes = state.positions[None]
    for _ in range(SHIFT_ITERATIONS):
        actions = np.zeros((count, 2, 6))
        actions[..., :3] = np.diff(offsets, axis=0)[:, None] / STEP_TIME
        spec = RolloutSpec(state, actions, STEP_TIME, obstacles=problem.packed_supports)
        nodes = problem.rod.rollout(spec).positions
        aside = np.mean((nodes - state.positions)[:, leaning], axis=1)
        # A rope that hangs freely moves with its grips.
        offsets[1:, :2] -= aside[:, :2]
    return offsets[1:], nodes


def _height(problem: Problem, nodes: Float64[np.ndarray, "*b n 3"]) -> Float64[np.ndarray, "*b n"]:
    """Distances between the surfaces of the rope's nodes and the nearest support [m]."""
    return scene_distance(nodes, problem.supports) - problem.radius

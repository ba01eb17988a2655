from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, chain_clearance, pack, signed_distance
from lariat.geometry.poses import Pose
from lariat.planning.landing import HOVER_CLEARANCE, LIFT_STEP, plan_landing
from lariat.planning.problem import Problem, WholePath
from lariat.planning.shorter_path import stay
from lariat.planning.whole_path import plan
from lariat.rod import Rod, RodProperties
from lariat.scenario.sections import Goal, Limits

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
BAR = Obstacle(
    "capsule",
    (0.02, 0.08, 0.23),
    orientation=(0.5**0.5, 0.5**0.5, 0.0, 0.0),
    radius=0.015,
    height=0.16,
    support=True,
    name="bar",
)


@pytest.fixture(scope="module")
def over_the_bar() -> Problem:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 24)
    start = tuple(Pose(np.array([x, -0.16, 0.40]), LEVEL) for x in (-0.2, 0.2))
    goal = (Pose(np.array([-0.15, 0.08, 0.34]), LEVEL), Pose(np.array([0.15, 0.08, 0.36]), LEVEL))
    moves = np.zeros((2, 6), dtype=bool)
    moves[:, :3] = True
    return Problem(
        rod=rod,
        state=rod.rest(*start).state,
        grips=(start[0], start[1]),
        goal=Goal(rod.rest(*goal, obstacles=pack([BAR])).state.positions, *goal),
        moves=moves,
        obstacles=(),
        supports=(BAR,),
        limits=Limits(),
        clearance=0.012,
        tolerance=0.003,
    )


@pytest.fixture(scope="module")
def path(over_the_bar: Problem) -> WholePath:
    return plan(over_the_bar)


def leaning_nodes(problem: Problem) -> np.ndarray:
    return np.flatnonzero(signed_distance(problem.goal.nodes, BAR) - problem.radius < 0.003)


def gaps(problem: Problem, path: WholePath) -> Float64[np.ndarray, "t"]:
    return np.array([chain_clearance(nodes, problem.radius, [BAR]) for nodes in path.nodes])


def test_a_rope_touches_its_support_where_it_comes_to_lie(over_the_bar: Problem, path: WholePath):
    assert path.reached, path.reason
    touching = gaps(over_the_bar, path) < 0.002
    leaning = leaning_nodes(over_the_bar)
    beside = (path.nodes[touching][:, leaning] - over_the_bar.goal.nodes[leaning])[..., :2]
    assert touching.sum() > 10
    # Without a landing it would slide 24 mm along the bar, lowered straight 29 mm along itself.
    along_rope, along_bar = np.abs(beside.mean(axis=1)).max(axis=0)
    assert along_bar < 0.001
    assert along_rope < 0.010


def test_a_stiff_rope_that_bends_aside_on_its_support_touches_it_where_it_comes_to_lie(
    over_the_bar: Problem,
):
    rough = replace(BAR, friction=0.3)
    rod = Rod(RodProperties(0.4455, 0.008, 0.044, 1.84e6), 40)
    goal = replace(
        over_the_bar.goal,
        nodes=rod.rest(*over_the_bar.goal.grips, obstacles=pack([BAR])).state.positions,
    )
    state = rod.rest(*over_the_bar.grips).state
    problem = replace(over_the_bar, rod=rod, state=state, goal=goal, supports=(rough,))
    path = plan_landing(problem, plan)
    assert path is not None
    touching = gaps(problem, path) < 0.002
    beside = (path.nodes[touching] - goal.nodes)[:, leaning_nodes(problem), 1]
    # Grips that go aside before the rope lies lay it 13 to 18 mm beside.
    assert touching.sum() > 10
    assert np.abs(beside.mean(axis=1)).max() < 0.005


def test_a_rope_rests_above_its_support_before_it_is_lowered(
    over_the_bar: Problem, path: WholePath
):
    gap = gaps(over_the_bar, path)
    first = int(np.argmax(gap < 0.002))
    grip_speeds = np.linalg.norm(np.diff(path.positions, axis=0), axis=2).max(axis=1) / path.dt
    node_speeds = np.linalg.norm(np.diff(path.nodes, axis=0), axis=2).max(axis=1) / path.dt
    resting = (grip_speeds < 1e-3) & (node_speeds < 0.02) & (gap[1:] > 0.010)
    assert resting[first // 2 : first].any()


def test_a_goal_that_leans_on_nothing_has_no_landing(over_the_bar: Problem):
    up = np.array([0.0, 0.0, 0.2])
    grips = tuple(replace(g, position=g.position + up) for g in over_the_bar.goal.grips)
    above = replace(
        over_the_bar,
        goal=Goal(over_the_bar.rod.rest(*grips).state.positions, grips[0], grips[1]),
    )
    assert plan_landing(above, plan) is None


def test_an_end_that_is_fixed_cannot_be_lowered(over_the_bar: Problem):
    moves = over_the_bar.moves.copy()
    moves[0] = False
    assert plan_landing(replace(over_the_bar, moves=moves), plan) is None


def test_the_grips_hover_no_higher_than_the_rope_needs(over_the_bar: Problem):
    asked: list[Problem] = []

    def approach(problem: Problem) -> WholePath:
        asked.append(problem)
        return stay(problem, "")

    plan_landing(over_the_bar, approach)
    gap = chain_clearance(asked[0].goal.nodes, over_the_bar.radius, [BAR])
    assert HOVER_CLEARANCE - 1e-3 < gap < HOVER_CLEARANCE + LIFT_STEP


def test_a_rope_without_room_above_its_support_is_laid_onto_it_all_the_same(
    over_the_bar: Problem,
):
    low, high = over_the_bar.limits.workspace
    limits = replace(over_the_bar.limits, workspace=(low, (high[0], high[1], 0.381)))
    down = np.array([0.0, 0.0, -0.02])
    left, right = (replace(g, position=g.position + down) for g in over_the_bar.grips)
    state = over_the_bar.rod.rest(left, right).state
    problem = replace(over_the_bar, limits=limits, grips=(left, right), state=state)
    landed = plan_landing(problem, plan)
    assert landed is not None
    assert not landed.reached
    path = plan(problem)
    assert path.reached, path.reason

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.planning.problem import Problem
from lariat.planning.tree_search.search import TreeSearch
from lariat.rod import RolloutSpec
from lariat.scenario import Goal
from tests.lariat.planning.test_whole_path import LEVEL, behind_the_wall, window

__all__ = ["behind_the_wall"]


@pytest.fixture(scope="module")
def exchange(behind_the_wall: Problem) -> Problem:
    """Problem whose grips change places without rotating."""
    start = tuple(Pose(np.array([x, 0.0, 0.45]), LEVEL) for x in (-0.15, 0.15))
    goal = tuple(Pose(np.array([x, 0.1, 0.45]), LEVEL) for x in (0.15, -0.15))
    rod = behind_the_wall.rod
    return replace(
        behind_the_wall,
        state=rod.rest(start[0], start[1]).state,
        grips=(start[0], start[1]),
        goal=Goal(rod.rest(goal[0], goal[1]).state.positions, goal[0], goal[1]),
        obstacles=(TABLE,),
    )


def test_trees_lead_a_rope_lengthwise_through_a_window_half_as_wide(
    behind_the_wall: Problem,
) -> None:
    moves = np.ones((2, 6), dtype=bool)
    problem = replace(behind_the_wall, moves=moves, obstacles=window(0.15, 0.18, 0.22))
    found = TreeSearch(problem, 0.008, 2).run(150)
    assert found.reaches_goal
    blocks = 3 * len(found.grips)
    actions = found.displacements(blocks) / 0.4
    rollout = problem.rod.rollout(RolloutSpec(problem.state, actions, 0.4))
    clear = [chain_clearance(n, problem.radius, problem.obstacles) for n in rollout.positions]
    assert min(clear) > 0.003
    last = np.mean(np.linalg.norm(rollout.positions[-1] - problem.goal.nodes, axis=1))
    assert last < 0.02


def test_the_same_seed_finds_the_same_path(exchange: Problem) -> None:
    one, two = (TreeSearch(exchange, 0.008, 2).run(150) for _ in range(2))
    assert one.reaches_goal
    assert np.array_equal(one.grips.positions, two.grips.positions)


def test_without_a_way_the_trees_end_at_the_nearest_shape_that_they_reached(
    behind_the_wall: Problem,
) -> None:
    wall = Obstacle("box", (0.0, 0.0, 1.0), size=(3.0, 0.01, 2.0), name="wall")
    problem = replace(behind_the_wall, obstacles=(TABLE, wall))
    search = TreeSearch(problem, 0.008)
    assert not search.run(10).reaches_goal
    # It goes on where it was: the same tree as of one search of twenty iterations.
    path = search.run(20)
    whole = TreeSearch(problem, 0.008).run(20)
    assert np.array_equal(path.grips.positions, whole.grips.positions)
    assert not path.reaches_goal
    assert path.grips.positions[..., 1].max() < 0.0


def test_a_fixed_grip_stays_where_it_is(behind_the_wall: Problem) -> None:
    moves = behind_the_wall.moves.copy()
    moves[0] = False
    left, right = behind_the_wall.grips
    goal = (left, Pose(right.position + np.array([-0.1, 0.25, -0.1]), right.orientation))
    post = Obstacle("cylinder", (0.12, 0.0, 0.3), radius=0.02, height=0.6, name="post")
    problem = replace(
        behind_the_wall,
        moves=moves,
        goal=Goal(behind_the_wall.rod.rest(*goal).state.positions, *goal),
        obstacles=(TABLE, post),
    )
    found = TreeSearch(problem, 0.008, 0).run(150)
    assert found.reaches_goal
    assert np.ptp(found.grips.positions[:, 0], axis=0).max() == 0.0
    np.testing.assert_allclose(found.grips.positions[-1, 1], goal[1].position, atol=1e-12)


def test_displacements_lead_through_all_poses(exchange: Problem) -> None:
    found = TreeSearch(exchange, 0.008, 2).run(150)
    moved = found.displacements(40)
    whole = found.grips.positions[-1] - found.grips.positions[0]
    np.testing.assert_allclose(moved[..., :3].sum(axis=0), whole, atol=1e-12)

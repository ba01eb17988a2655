from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.planning.path_optimization.block_path import BLOCKS
from lariat.planning.problem import Problem
from lariat.planning.seeds import lift_offsets, seed_paths, sidestep_offsets
from tests.lariat.planning.test_whole_path import behind_the_wall

__all__ = ["behind_the_wall"]


def ends(problem: Problem) -> np.ndarray:
    """Displacement of both grips from start to goal [m]."""
    pairs = zip(problem.goal.grips, problem.grips, strict=True)
    return np.stack([goal.position - now.position for goal, now in pairs])


def test_every_seed_ends_at_the_grips_of_the_goal(behind_the_wall: Problem) -> None:
    seeds = seed_paths(behind_the_wall)
    assert len(seeds) > 12
    for displacements in seeds:
        assert displacements.shape == (BLOCKS, 2, 3)
        np.testing.assert_allclose(displacements.sum(axis=0), ends(behind_the_wall), atol=1e-12)


def test_the_first_seed_is_straight(behind_the_wall: Problem) -> None:
    even = np.broadcast_to(ends(behind_the_wall) / BLOCKS, (BLOCKS, 2, 3))
    np.testing.assert_allclose(seed_paths(behind_the_wall)[0], even, atol=1e-12)


def test_the_highest_lift_brings_the_rope_over_the_highest_obstacle(
    behind_the_wall: Problem,
) -> None:
    lift = lift_offsets(behind_the_wall)[-1][2]
    lowest = min(
        behind_the_wall.state.positions[:, 2].min(), behind_the_wall.goal.nodes[:, 2].min()
    )
    clearance = lowest + lift - behind_the_wall.radius - 0.19
    assert behind_the_wall.clearance <= clearance < behind_the_wall.clearance + 0.02


def test_a_free_scene_has_neither_lifts_nor_sidesteps(behind_the_wall: Problem) -> None:
    free = replace(behind_the_wall, obstacles=behind_the_wall.obstacles[:1])
    assert lift_offsets(free) == []
    assert sidestep_offsets(free) == []


def test_a_floor_is_not_lifted_over_and_hides_no_sidestep(behind_the_wall: Problem) -> None:
    floor = Obstacle("box", (0.0, 0.0, -0.025), size=(2.0, 2.0, 0.05), name="floor")
    near = replace(floor, position=(0.0, 0.0, behind_the_wall.goal.nodes[:, 2].min() - 0.03))
    for body in (floor, near):
        problem = replace(behind_the_wall, obstacles=(*behind_the_wall.obstacles, body))
        assert np.array_equal(lift_offsets(problem), lift_offsets(behind_the_wall))
        assert np.array_equal(sidestep_offsets(problem), sidestep_offsets(behind_the_wall))


def test_a_fixed_grip_stays_in_every_seed(behind_the_wall: Problem) -> None:
    moves = behind_the_wall.moves.copy()
    moves[0] = False
    fixed = replace(behind_the_wall, moves=moves)
    for displacements in seed_paths(fixed):
        assert not displacements[:, 0].any()


def test_another_seed_gives_other_random_paths(behind_the_wall: Problem) -> None:
    again, same = (np.array(seed_paths(behind_the_wall)) for _ in range(2))
    other = np.array(seed_paths(replace(behind_the_wall, seed=1)))
    assert np.array_equal(again, same)
    assert not np.allclose(again, other)

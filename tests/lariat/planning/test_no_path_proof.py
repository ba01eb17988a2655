from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.planning.no_path_proof import proof_of_no_path
from lariat.planning.problem import Problem
from tests.lariat.planning.test_whole_path import behind_the_wall, window

__all__ = ["behind_the_wall"]


def test_a_closed_wall_of_10_mm_leaves_no_path(behind_the_wall: Problem) -> None:
    wall = Obstacle("box", (0.0, 0.0, 1.0), size=(3.0, 0.01, 2.0), name="wall")
    reason = proof_of_no_path(replace(behind_the_wall, obstacles=(TABLE, wall)))
    assert reason.startswith("blocked")
    assert "left gripper" in reason
    assert "34 mm" in reason


def test_no_proof_where_the_gripper_just_passes(behind_the_wall: Problem) -> None:
    for width in (0.035, 0.3):
        problem = replace(behind_the_wall, obstacles=window(0.1, width, width))
        assert proof_of_no_path(problem) == ""


def test_no_proof_over_walls_below_the_top_of_the_workspace(behind_the_wall: Problem) -> None:
    wall = Obstacle("box", (0.0, 0.0, 0.5), size=(3.0, 0.01, 1.0), name="wall")
    assert proof_of_no_path(replace(behind_the_wall, obstacles=(TABLE, wall))) == ""


def test_no_proof_between_random_posts_around_a_free_corridor(behind_the_wall: Problem) -> None:
    random = np.random.default_rng(0)
    # A free corridor leads each gripper round by x < -0.57, past all posts.
    posts = tuple(
        Obstacle("cylinder", (x, y, 0.6), radius=0.02, height=1.2, name=f"post-{k}")
        for k, (x, y) in enumerate(random.uniform((-0.55, -0.1), (0.8, 0.1), (8, 2)).tolist())
    )
    assert proof_of_no_path(replace(behind_the_wall, obstacles=(TABLE, *posts))) == ""

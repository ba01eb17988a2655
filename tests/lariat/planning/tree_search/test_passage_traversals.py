from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle, chain_clearance
from lariat.geometry.poses import Pose
from lariat.planning.problem import Problem
from lariat.planning.tree_search import passage_traversals
from lariat.planning.tree_search.grip_motion import Chords
from lariat.planning.tree_search.passage_traversals import find_threads
from lariat.planning.tree_search.passages import Passages, find_passages
from lariat.planning.tree_search.sag import SagTable
from lariat.planning.whole_path import plan
from lariat.rod import EDGE_AXIS
from lariat.scenario.sections import Limits
from tests.lariat.planning.test_whole_path import behind_the_wall, window

__all__ = ["behind_the_wall"]

CENTRE = np.array([0.0, 0.0, 0.308])
"""Middle of the opening [m]."""


@pytest.fixture(scope="module")
def narrow(behind_the_wall: Problem) -> Problem:
    """Problem with a window in its wall twice as wide and as high as the rope is thick."""
    thin = replace(Limits(), gripper_radius=0.004, gripper_height=0.008, keep_out=0.0, spacing=0.03)
    return replace(
        behind_the_wall,
        moves=np.ones((2, 6), dtype=bool),
        obstacles=window(0.30, 0.016, 0.016)[1:],
        limits=thin,
        clearance=0.002,
    )


@pytest.fixture(scope="module")
def threads(narrow: Problem) -> Chords:
    passage = Passages(CENTRE[None], np.array([[0.0, -1.0, 0.0]]))
    sag = SagTable(narrow.rod)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(passage_traversals, "TAUT_SHARE", 0.98)
        return find_threads(narrow, passage, sag, 0.006, 0.025)


def test_the_middle_of_a_narrow_window_is_found(narrow: Problem) -> None:
    low, high = np.array([-0.3, -0.3, 0.1]), np.array([0.3, 0.3, 0.5])
    random = np.random.default_rng(0)
    found = find_passages(narrow, low, high, 0.0055, random)
    away = np.linalg.norm(found.places[:, [0, 2]] - CENTRE[[0, 2]], axis=1)
    assert away.min() < 0.002
    assert abs(found.directions[np.argmin(away), 1]) > 0.95


def test_on_a_thread_the_rope_lies_in_the_middle_of_its_passage(
    narrow: Problem, threads: Chords
) -> None:
    for middles, chords in zip(threads.middles, threads.chords, strict=True):
        for middle, chord in zip(middles, chords, strict=True):
            along = poses.rotation_between(EDGE_AXIS, chord / np.linalg.norm(chord))
            grips = [Pose(middle + s * chord, along) for s in (-0.5, 0.5)]
            rope = narrow.rod.rest(grips[0], grips[1]).state.positions
            assert chain_clearance(rope, narrow.radius, narrow.obstacles) > 0.0015


def test_threads_lead_from_the_start_to_the_goal_with_either_grip_ahead(threads: Chords) -> None:
    reach = 0.5 * np.linalg.norm(threads.chords[0, 0])
    assert (threads.middles[:, 0, 1] < -reach).all()
    assert (threads.middles[:, -1, 1] > reach).all()
    assert sorted(np.sign(threads.chords[:, 0, 1])) == [-1.0, 1.0]


def test_a_window_of_two_diameters_is_passed(narrow: Problem) -> None:
    path = plan(narrow)
    assert path.reached, path.reason
    assert path.clearance > 0.0015


def test_a_path_that_replaces_one_that_was_not_followed_uses_no_threads(narrow: Problem) -> None:
    passage = Passages(CENTRE[None], np.array([[0.0, 1.0, 0.0]]))
    careful = replace(narrow, clearance=0.005, spare_clearance=0.003)
    sag = SagTable(narrow.rod)
    assert not len(find_threads(careful, passage, sag, 0.006, 0.025))


def test_a_fixed_end_has_no_threads(narrow: Problem) -> None:
    moves = narrow.moves.copy()
    moves[0] = False
    wall = Obstacle("box", (0.0, 0.0, 0.5), size=(0.1, 0.02, 0.1))
    problem = replace(narrow, moves=moves, obstacles=(wall,))
    passage = Passages(CENTRE[None], np.array([[0.0, 1.0, 0.0]]))
    sag = SagTable(narrow.rod)
    assert not len(find_threads(problem, passage, sag, 0.006, 0.025))

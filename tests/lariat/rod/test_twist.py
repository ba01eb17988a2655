"""Turns of twist are counted; a rod keeps them while it moves, but for those in its loops."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import (
    Rod,
    RodProperties,
    RolloutSpec,
    add_turns,
    connected,
    count_turns,
    count_turns_along,
)
from lariat.rod.initial_shapes import EDGE_AXIS

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
GRIPS = tuple(Pose(np.array([x, 0.0, 0.3]), ALONG_X) for x in (-0.17, 0.17))


@pytest.fixture(scope="module")
def rod() -> Rod:
    return Rod(RodProperties(0.45, 0.008, 0.044, 1e7), 30)


@pytest.mark.parametrize("count", [-2, -1, 0, 1, 3])
def test_rest_keeps_the_turns_of_its_guess(rod: Rod, count: int) -> None:
    rest = rod.rest(*GRIPS, guess=add_turns(rod.rest(*GRIPS).state, count))
    assert rest.converged
    assert count_turns(rest.state) == count


def test_turning_an_end_about_the_rope_adds_a_turn_and_bends_it_out_of_its_plane(rod: Rod) -> None:
    state = rod.rest(*GRIPS).state
    assert np.ptp(state.positions[:, 1]) < 1e-6
    action = np.zeros((1, 2, 6))
    action[0, 1, 3:] = poses.rotate(ALONG_X, EDGE_AXIS) * 2.0 * np.pi / 12.0
    moved = rod.rollout(RolloutSpec(state, action, 0.4, steps=30)).final
    assert count_turns(moved) == 1
    # The rod has settled by then: the same shape as with the turn added at once.
    rest = rod.rest(*GRIPS, guess=add_turns(state, 1)).state
    assert np.abs(moved.positions - rest.positions).max() < 2e-3
    assert np.ptp(rest.positions[:, 1]) > 0.03


@pytest.mark.parametrize("count", [-1, 1])
def test_a_loop_takes_the_turn_of_twist_that_made_it(rod: Rod, count: int) -> None:
    twisted = rod.rest(*GRIPS, guess=add_turns(rod.rest(*GRIPS).state, count)).state
    nearer = np.zeros((1, 2, 6))
    nearer[0, :, 0] = 0.03, -0.03
    looped = rod.rollout(RolloutSpec(twisted, nearer, 0.01, steps=400)).final
    assert count_turns(twisted) == count
    assert count_turns(looped) == 0
    assert count_turns_along(twisted, looped.positions) == 0
    assert count_turns_along(looped, twisted.positions) == count


def test_ends_that_change_places_without_rotating_leave_a_turn_in_the_rod(rod: Rod) -> None:
    start = rod.rest(*GRIPS).state
    flat = rod.rest(*GRIPS[::-1]).state
    assert count_turns(flat) == 0
    reached = [k for k in range(-2, 3) if connected(start, add_turns(flat, k))]
    assert reached == [-1, 1]
    # They pass each other at a distance of 0.1 m.
    half = np.pi * np.arange(101) / 100
    left = np.stack([-0.17 * np.cos(half), -0.05 * np.sin(half), np.zeros(101)], axis=1)
    actions = np.zeros((100, 2, 6))
    actions[:, 0, :3] = np.diff(left, axis=0) / 0.05
    actions[:, 1, :3] = -actions[:, 0, :3]
    moved = rod.rollout(RolloutSpec(start, actions, 0.05)).final
    assert connected(start, moved)
    rest = rod.rest(*GRIPS[::-1], guess=moved).state
    assert abs(count_turns(rest)) == 1

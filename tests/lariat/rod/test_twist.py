"""Turns of twist are counted as they are put in, and stay in a rod that is moved."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties
from lariat.rod.twist import AXIS, turns, wound

LEVEL = np.array([0.5, 0.5, 0.5, 0.5])
GRIPS = tuple(Pose(np.array([x, 0.0, 0.3]), LEVEL) for x in (-0.17, 0.17))


@pytest.fixture(scope="module")
def rod() -> Rod:
    return Rod(RodProperties(0.45, 0.008, 0.044, 1e7), 30)


@pytest.mark.parametrize("count", [-2, -1, 0, 1, 3])
def test_rest_keeps_the_turns_of_its_guess(rod: Rod, count: int) -> None:
    rest = rod.rest(*GRIPS, guess=wound(rod.rest(*GRIPS).state, count))
    assert rest.converged
    assert turns(rest.state) == count


def test_turning_an_end_about_the_rope_adds_a_turn_and_bends_it_out_of_its_plane(rod: Rod) -> None:
    state = rod.rest(*GRIPS).state
    assert np.ptp(state.positions[:, 1]) < 1e-6
    action = np.zeros((1, 2, 6))
    action[0, 1, 3:] = poses.rotate(LEVEL, AXIS) * 2.0 * np.pi / 12.0
    moved = rod.rollout(state, action, 0.4, steps=30, block_of_step=np.zeros(30, dtype=int)).final
    assert turns(moved) == 1
    # The longest step is forgotten by then: the same shape as the one that was wound at once.
    rest = rod.rest(*GRIPS, guess=wound(state, 1)).state
    assert np.abs(moved.positions - rest.positions).max() < 2e-3
    assert np.ptp(rest.positions[:, 1]) > 0.03

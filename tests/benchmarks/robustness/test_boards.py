from __future__ import annotations

import numpy as np
import pytest

from benchmarks.robustness.boards import MAX_SHIFT, MAX_TURN, BoardSpec
from lariat.scenario import load


def board(number: int) -> BoardSpec:
    return BoardSpec(number, "links", 120, friction_error=2.0, yield_error=1.5, source="camera")


def test_a_board_is_the_same_for_the_same_number():
    assert board(3).scenario == board(3).scenario
    assert board(3).scenario.clips != board(4).scenario.clips


def test_clips_are_moved_and_turned_within_their_bounds():
    base = load("harness-board")
    pairs = [
        pair
        for number in range(50)
        for pair in zip(board(number).scenario.clips, base.clips, strict=True)
    ]
    shifts = [np.subtract(clip.position, before.position) for clip, before in pairs]
    turns = [clip.heading - before.heading for clip, before in pairs]
    assert 0.9 * MAX_SHIFT < np.max(np.abs(shifts)) <= MAX_SHIFT
    assert np.all(np.array(shifts)[:, 2] == 0.0)
    assert 0.9 * MAX_TURN < np.max(np.abs(turns)) <= MAX_TURN


def test_friction_and_yield_of_the_true_cable_are_others():
    scenario = board(0).scenario
    assert scenario.plant.friction == 0.6
    assert scenario.rope.bending_radius == 0.05
    assert scenario.plant_rope.bending_radius == pytest.approx(0.05 / 1.5)
    assert scenario.plant_rope.node_count == 120

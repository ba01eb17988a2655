"""Diagram of error over time: its motion, its reference, and which settings are best."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.compare import bench, continuum, mujoco_ropes, our_rod
from benchmarks.compare.motion import actions, grip_path, rest_state
from lariat.geometry import poses

MOVES = actions()[20:23]


def test_short_steps_of_the_grips_end_where_long_ones_do() -> None:
    positions, turns = grip_path(MOVES, 0.01)
    finer_positions, finer_turns = grip_path(MOVES, 0.001)
    assert (len(positions), len(finer_positions)) == (3, 30)
    np.testing.assert_allclose(finer_positions[-1], positions[-1], rtol=0.0, atol=1e-12)
    between = poses.multiply(poses.conjugate(finer_turns[-1]), turns[-1])
    np.testing.assert_allclose(np.abs(between[:, 0]), 1.0, rtol=0.0, atol=1e-12)


def test_errors_of_more_nodes_and_shorter_steps_are_smaller() -> None:
    there = continuum.solve(MOVES)
    errors = [
        there.moving_errors(our_rod.rod("sdirk2", n, substeps).start(MOVES).run()).mean()
        for n, substeps in ((10, 1), (20, 2), (40, 5))
    ]
    assert errors[0] > 4.0 * errors[1] > 16.0 * errors[2]
    assert there.own_error_mm < 0.1 * errors[2]


@pytest.mark.parametrize("name", mujoco_ropes.ROPES)
def test_ropes_of_the_engine_follow_the_same_motion(name: str) -> None:
    path = mujoco_ropes.rope(name, 20, 0.002).start(MOVES).run()
    ours = our_rod.rod("sdirk2", 20, 5).start(MOVES).run()
    assert np.linalg.norm(path - ours, axis=2).max() < 3e-3
    # Far less than the motion itself.
    assert np.linalg.norm(ours[-1] - rest_state(20).positions, axis=1).max() > 6e-3


def test_the_front_leaves_out_settings_that_a_faster_one_beats() -> None:
    rows = [
        {"us": us, "moving_mm": error}
        for us, error in ((30, 1.0), (10, 2.0), (20, 3.0), (40, 0.99))
    ]
    assert [row["us"] for row in bench.unbeaten(rows, "moving_mm")] == [10, 30]

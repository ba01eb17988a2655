from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.safety.constraints.path_densification import (
    GRIPPER_LEVER_ARM,
    MAX_POSE_SPACING,
    densified,
    stop_times,
)
from lariat.trajectory import Stop
from tests.services.robot_gateway.cells import ALONG_X, LIMITS, World
from tests.services.robot_gateway.test_cell import REST


@pytest.mark.parametrize("speed", [0.0, 0.05, 0.5, 2.0])
def test_stop_is_judged_every_few_millimetres_from_any_speed(speed: float) -> None:
    limits = replace(LIMITS, speed=2.0)
    velocity = np.array([[[speed, 0.0, 0.0], [0.0, 0.0, 1.5]]])
    stop = Stop.plan(velocity, 0.5 * velocity, limits)
    moved = stop.at(stop_times(stop))[0]
    steps = np.linalg.norm(np.diff(moved, axis=0), axis=-1)[:, 0] @ np.array(
        [1.0, GRIPPER_LEVER_ARM]
    )
    assert np.max(steps) <= MAX_POSE_SPACING * 1.001
    np.testing.assert_allclose(moved[-1], stop.at(stop.duration)[0])


def test_dense_path_keeps_its_poses_and_rotates_evenly() -> None:
    positions = np.array([[[0.0, 0.0, 0.0]], [[0.1, 0.0, 0.0]], [[0.1, 0.001, 0.0]]])
    quarter = poses.exponential(np.array([0.0, 0.0, 0.5]))
    turns = np.array([[ALONG_X], [poses.multiply(quarter, ALONG_X)]])
    turns = np.concatenate([turns, turns[-1:]])
    p, q = densified(positions, turns)
    for pose in positions[:, 0]:
        assert np.min(np.linalg.norm(p[:, 0] - pose, axis=1)) < 1e-12
    assert np.max(np.linalg.norm(np.diff(p, axis=0), axis=-1)) <= MAX_POSE_SPACING
    middle = poses.multiply(poses.exponential(np.array([0.0, 0.0, 0.25])), ALONG_X)
    at = int(np.argmin(np.abs(p[:, 0, 0] - 0.05)))
    np.testing.assert_allclose(np.abs(q[at, 0] @ middle), 1.0, atol=1e-3)


def test_small_thing_between_two_poses_of_a_chunk_is_not_missed() -> None:
    # 80 mm from pose to pose: none of them comes near it.
    bead = Obstacle("sphere", (0.2, 0.16, 0.3), radius=0.004, name="bead")
    world = World(obstacles=[TABLE, bead])
    along = np.minimum(np.array([0, 0, 0.2, 1, 2, 2.8, 3, 3, 3, 3]), 3.0) * 0.08
    points = REST + along[:, None, None] * np.array([[[0.0, 1.0, 0.0]]])
    world.send_points(points, dt=0.2)
    assert world.step().rule == "keep_out", world.report.refusal
    free = World()
    free.send_points(points, dt=0.2)
    assert free.step().rule is None, free.report.refusal

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.grippers import (
    GRIPPER_COVER_RATIO,
    GripperBody,
    axis_clearance,
    axis_spacing,
    gripper_bodies,
    gripper_capsules,
    gripper_points,
    swept_gripper_points,
)
from lariat.geometry.obstacles import signed_distance
from lariat.geometry.poses import Pose

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])


@pytest.mark.parametrize("length", [0.0, 0.005, 0.012, 0.048, 0.3])
@pytest.mark.parametrize("radius", [0.004, 0.012, 0.05])
def test_cover_is_no_larger_than_its_stated_ratio_and_holds_the_capsule(
    length: float, radius: float
) -> None:
    centres, cover = GripperBody(end=(0.0, 0.0, length), radius=radius).spheres
    assert radius <= cover <= GRIPPER_COVER_RATIO * radius
    # Points on the side of the capsule, the farthest ones from its axis.
    side = np.stack([[radius, 0.0, z] for z in np.linspace(0.0, length, 50)])
    nearest = np.linalg.norm(side[:, None] - centres, axis=2).min(axis=1)
    assert nearest.max() <= cover + 1e-12


@pytest.mark.parametrize("radius", [0.001, 0.012, 0.05])
def test_planned_distances_satisfy_the_cover(radius: float) -> None:
    keep_out = 0.005
    _, cover = GripperBody(end=(0.0, 0.0, 4.0 * radius), radius=radius).spheres
    assert axis_clearance(radius, keep_out) >= cover + keep_out
    assert axis_spacing(radius, keep_out) >= 2.0 * cover + keep_out


def test_gripper_bodies_point_away_from_the_rope() -> None:
    left, right = gripper_bodies(0.048, 0.012)
    assert left.end == (0.0, 0.0, -0.048)
    assert right.end == (0.0, 0.0, 0.048)


def test_gripper_points_lie_on_the_axes_and_away_from_the_rope() -> None:
    left, right = Pose(np.array([-0.2, 0, 0.3]), ALONG_X), Pose(np.array([0.2, 0, 0.3]), ALONG_X)
    points = gripper_points(left, right, 0.06)
    assert np.allclose(points[[0, 2, 3, 5], 0], [-0.2, -0.26, 0.2, 0.26])
    turned = poses.multiply(poses.exponential(np.array([0.3, -0.2, 0.5])), ALONG_X)
    other = Pose(np.array([0.1, 0.1, 0.2]), turned)
    swept = swept_gripper_points(
        np.array([[left.position, right.position], [left.position, other.position]]),
        np.array([[ALONG_X, ALONG_X], [ALONG_X, turned]]),
        0.06,
    )
    assert np.allclose(swept, np.concatenate([points, gripper_points(left, other, 0.06)]))


def test_a_gripper_reaches_away_from_the_rope() -> None:
    along_x = Pose(np.array([0.2, 0.0, 0.3]), ALONG_X)
    (body,) = gripper_capsules(None, along_x, 0.048, 0.012)
    points = np.array([[0.2 + 0.0599, 0.0, 0.3], [0.2 + 0.0601, 0.0, 0.3], [0.185, 0.0, 0.3]])
    inside = signed_distance(points, body) < 0.0
    assert inside.tolist() == [True, False, False]
    assert body.height == pytest.approx(0.048)

from __future__ import annotations

import numpy as np
import pytest

from lariat.arms.cr5_kinematics import Kinematics
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from services.cr5_emulator import frames
from services.cr5_emulator.kinematics import CALIBRATED_GEOMETRY, NOMINAL_GEOMETRY

HERE = Pose(np.zeros(3), poses.IDENTITY)
# Joints [deg], flange [mm, deg], quaternion; poses 2 and 3 are the vendor's own numbers.
POSES = [
    ((0, 0, 0, 0, 0, 0), (0, -246, 1047, -90, 0, 180), (0, 0, 0.707107, -0.707107)),
    ((0, 0, -90, 0, 90, 0), (473, -141, 469, 180, 0, -90), (0, 0.707107, -0.707107, 0)),
    ((0, 0, 90, 0, -90, 0), (-473, -141, 469, 180, 0, 90), (0, 0.707107, 0.707107, 0)),
    (
        (30, -20, 70, 15, -80, 40),
        (-159.6383, -276.0337, 733.0311, -165.9971, 23.0923, 85.0967),
        (0.046356, 0.732915, 0.639614, -0.227116),
    ),
    (
        (10, 20, -100, -15, 75, -160),
        (336.7125, -111.3989, 499.0948, 179.6258, 15.7889, 80.6068),
        (0.091308, 0.755108, 0.641043, -0.102653),
    ),
    (
        (45, -35, -60, 25, 100, -30),
        (613.5541, 439.9354, 408.1689, -157.7931, -1.7017, -13.5664),
        (0.189491, -0.974643, 0.113049, -0.037213),
    ),
    ((-90, 30, -120, 0, 90, 0), (-141, -259.5, 411.7928, 180, 0, 180), (0, 0, 1, 0)),
    (
        (-60, 25, -110, -5, 90, 45),
        (23.4822, -322.6723, 460.1080, 180, 0, 165),
        (0, 0.130526, 0.991445, 0),
    ),
]


@pytest.mark.parametrize(("joints", "vector", "quaternion"), POSES)
def test_both_models_hold_the_published_poses(
    joints: tuple, vector: tuple, quaternion: tuple
) -> None:
    T = NOMINAL_GEOMETRY.flange(np.radians(joints))
    given = frames.transform(np.array(vector, dtype=float))
    np.testing.assert_allclose(1e3 * T[:3, 3], vector[:3], atol=1e-3)
    np.testing.assert_allclose(T[:3, :3], given[:3, :3], atol=2e-6)
    assert abs(poses.from_matrix(T[:3, :3]) @ np.array(quaternion)) > 1.0 - 1e-6
    flange = Kinematics(HERE, HERE).flange(np.radians(joints))
    np.testing.assert_allclose(flange.position, T[:3, 3], atol=1e-12)
    np.testing.assert_allclose(poses.matrix(flange.orientation), T[:3, :3], atol=1e-12)


def test_inverse_finds_the_joints_among_all_branches_on_both_geometries() -> None:
    rng = np.random.default_rng(5)
    for _ in range(40):
        joints = rng.uniform(-3.0, 3.0, 6)
        joints[2], joints[4] = rng.uniform(0.3, 2.5, 2) * rng.choice([-1.0, 1.0], 2)
        for geometry in (NOMINAL_GEOMETRY, CALIBRATED_GEOMETRY):
            goal = geometry.flange(joints)
            solutions = geometry.all_solutions(goal)
            assert min(np.max(np.abs(s - joints)) for s in solutions) < 1e-6
            for solution in solutions:
                np.testing.assert_allclose(geometry.flange(solution), goal, atol=1e-8)


def test_calibrated_arm_is_about_a_millimetre_from_the_nominal_one() -> None:
    far = [
        1e3 * np.linalg.norm((NOMINAL_GEOMETRY.flange(q) - CALIBRATED_GEOMETRY.flange(q))[:3, 3])
        for q in (np.radians(joints) for joints, _, _ in POSES)
    ]
    assert min(far) > 0.1
    assert 0.8 < max(far) < 1.7


@pytest.mark.parametrize("joints", [(10, 20, -60, 0, 0, 0), (10, 20, 0, 30, 60, 0)])
def test_jacobian_loses_rank_at_wrist_and_elbow(joints: tuple) -> None:
    kinematics = Kinematics(HERE, HERE)
    path = np.radians([joints, (0, 0, -90, 0, 90, 0)])
    singular, regular = kinematics.smallest_singular_values(path)
    assert singular < 1e-9
    assert regular > 0.2


def test_joint_speed_moves_the_grip_as_asked() -> None:
    base = Pose(np.array([0.7, 0.1, 0.0]), poses.exponential(np.array([0.0, 0.0, 2.0])))
    tool = Pose(np.array([0.01, 0.02, 0.12]), poses.exponential(np.array([0.0, 1.0, 0.3])))
    kinematics = Kinematics(base, tool)
    joints, e = np.radians([10.0, 20.0, -100.0, -15.0, 75.0, -160.0]), 1e-6
    velocity = np.array([[0.1, -0.2, 0.05], [0.3, 0.1, -0.4]])
    ahead = kinematics.grip(joints + e * kinematics.joint_speed(joints, velocity))
    here = kinematics.grip(joints)
    np.testing.assert_allclose((ahead.position - here.position) / e, velocity[0], atol=1e-5)
    turned = poses.multiply(ahead.orientation, poses.conjugate(here.orientation))
    np.testing.assert_allclose(poses.logarithm(turned) / e, velocity[1], atol=1e-5)

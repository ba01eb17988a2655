"""Compiled paths of an arm against Pinocchio and NumPy."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.arms.cr5_kinematics import Kinematics
from lariat.arms.path_kernel import EXACT_SINGULAR_VALUE
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.safety.constraints.singularity import MIN_SINGULAR_VALUE

USUAL_JOINTS = np.array([0.3, -0.5, 1.2, 0.2, 1.1, 0.4])


def arms() -> tuple[Kinematics, Kinematics]:
    """The same arm twice; the second one is compiled."""
    turn = poses.normalized(np.array([0.9, 0.2, -0.3, 0.1]))
    base = Pose(np.array([-0.8, 0.1, 0.2]), turn)
    tool = Pose(np.array([0.01, 0.02, 0.12]), poses.normalized(np.array([0.8, 0.1, 0.5, 0.2])))
    plain, compiled = Kinematics(base, tool), Kinematics(base, tool)
    compiled.compile()
    return plain, compiled


def test_path_and_links_are_those_of_single_poses() -> None:
    plain, compiled = arms()
    rng = np.random.default_rng(0)
    rows = USUAL_JOINTS + np.cumsum(0.05 * rng.normal(size=(9, 6)), axis=0)
    grips = [plain.grip(row) for row in rows]
    positions = np.array([grip.position for grip in grips])
    orientations = np.array([grip.orientation for grip in grips])
    expected = plain.follow(positions, orientations, USUAL_JOINTS)
    found = compiled.follow(positions, orientations, USUAL_JOINTS)
    assert expected is not None
    assert found is not None
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
    centres, radii = compiled.link_spheres(found)
    np.testing.assert_allclose(centres, plain.link_spheres(expected)[0], rtol=0.0, atol=1e-12)
    np.testing.assert_array_equal(radii, plain.link_spheres(expected)[1])


def test_singular_values_are_exact_where_they_are_small_and_bounded_elsewhere() -> None:
    assert EXACT_SINGULAR_VALUE > MIN_SINGULAR_VALUE
    plain, compiled = arms()
    rng = np.random.default_rng(1)
    exact = 0
    for k in range(300):
        joints = rng.uniform(-1.5, 1.5, 6)
        # Wrist and elbow are singular at zero.
        joints[4 if k % 2 else 2] = 10.0 ** rng.uniform(-9.0, 0.0)
        grip = plain.grip(joints)
        path = compiled.follow(grip.position[None], grip.orientation[None], joints)
        assert path is not None
        found = float(compiled.smallest_singular_values(path)[0])
        expected = float(plain.smallest_singular_values(joints[None])[0])
        if expected < EXACT_SINGULAR_VALUE:
            exact += 1
            assert abs(found - expected) < 1e-12
        else:
            assert min(0.4 * expected, EXACT_SINGULAR_VALUE) <= found <= expected + 1e-12
    assert exact > 100


def test_longer_paths_than_there_was_room_for_are_solved() -> None:
    plain, compiled = arms()
    rows = USUAL_JOINTS + np.linspace(0.0, 0.3, 150)[:, None]
    grips = [plain.grip(row) for row in rows]
    positions = np.array([grip.position for grip in grips])
    orientations = np.array([grip.orientation for grip in grips])
    for count in (2, 150, 3):
        found = compiled.follow(positions[:count], orientations[:count], USUAL_JOINTS)
        assert found is not None
        np.testing.assert_allclose(found[1:], rows[:count], rtol=0.0, atol=1e-7)
        centres = compiled.link_spheres(found)[0]
        np.testing.assert_allclose(centres, plain.link_spheres(found)[0], rtol=0.0, atol=1e-12)


def test_links_of_another_path_are_not_those_of_the_last_one() -> None:
    plain, compiled = arms()
    grip = plain.grip(USUAL_JOINTS)
    assert compiled.follow(grip.position[None], grip.orientation[None], USUAL_JOINTS) is not None
    other = USUAL_JOINTS[None] + 0.1
    np.testing.assert_array_equal(compiled.link_spheres(other)[0], plain.link_spheres(other)[0])


def test_joint_speeds_are_of_least_norm_also_at_a_singularity() -> None:
    plain, compiled = arms()
    velocity = np.array([[0.1, -0.2, 0.3], [0.5, 0.1, -0.4]])
    for joints in (USUAL_JOINTS, np.zeros(6)):
        expected = plain.joint_speed(joints, velocity)
        found = compiled.joint_speed(joints, velocity)
        np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("wrong", [5.0, np.nan])
def test_a_pose_out_of_reach_or_without_numbers_has_no_joints(wrong: float) -> None:
    _, compiled = arms()
    grip = compiled.grip(USUAL_JOINTS)
    there = grip.position + np.array([wrong, 0.0, 0.0])
    positions = np.array([grip.position, there, grip.position])
    orientations = np.array(3 * [grip.orientation])
    assert compiled.follow(positions, orientations, USUAL_JOINTS) is None
    assert compiled.solve(Pose(there, grip.orientation), USUAL_JOINTS) is None

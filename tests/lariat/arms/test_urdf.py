"""URDF: pose of a link by the joints, checked by Pinocchio."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.arms.cr5_kinematics import Kinematics
from lariat.arms.description import CR5_URDF
from lariat.arms.kinematics import UrdfKinematics
from lariat.arms.urdf import Urdf
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from tests.robots import PANDA, UR5, Robot

STILL = Pose(np.zeros(3), poses.IDENTITY)


def test_the_flange_is_where_pinocchio_has_it():
    arm, kinematics = Urdf(CR5_URDF), Kinematics(STILL, STILL)
    for joints in np.random.default_rng(0).uniform(-2.0, 2.0, (5, 6)):
        found = {arm.root: STILL}
        for parent, child, pose in arm.link_poses(arm.chain("link_6"), joints):
            found[child] = found[parent] @ pose
        expected = kinematics.flange(joints)
        np.testing.assert_allclose(found["link_6"].position, expected.position, atol=1e-9)
        turn = poses.multiply(poses.conjugate(found["link_6"].orientation), expected.orientation)
        np.testing.assert_allclose(poses.logarithm(turn), 0.0, atol=1e-9)


def test_collision_bodies_stand_in_for_missing_visuals():
    arm = Urdf(CR5_URDF)
    assert [body.link for body in arm.bodies] == ["base_link", *(f"link_{k}" for k in range(1, 7))]
    assert arm.bodies[0].shape == "cylinder"
    assert arm.bodies[0].size == (0.08, 0.1)


def test_a_sliding_joint_moves_along_its_axis(tmp_path: Path):
    path = tmp_path / "lift.urdf"
    path.write_text(
        '<robot name="lift"><link name="base"/><link name="car"/>'
        '<joint name="lift" type="prismatic"><parent link="base"/><child link="car"/>'
        '<origin xyz="0 0 1"/><axis xyz="0 2 0"/></joint>'
        '<link name="hook"/><joint name="bolt" type="fixed"><parent link="car"/>'
        '<child link="hook"/></joint></robot>'
    )
    lift = Urdf(path)
    (parent, child, pose), (*_, without_origin) = lift.link_poses(lift.chain("car"), [0.25])
    assert (parent, child) == ("base", "car")
    np.testing.assert_allclose(pose.position, [0.0, 0.25, 1.0])
    np.testing.assert_array_equal(without_origin.position, np.zeros(3))
    np.testing.assert_array_equal(without_origin.orientation, [1.0, 0.0, 0.0, 0.0])


def test_longest_chain_that_a_file_may_hold_is_followed_and_no_circle(tmp_path: Path):
    """Of a size that took minutes where each joint was compared with all others."""
    path, count = tmp_path / "long.urdf", 30_000
    links = "".join(f'<link name="{k}"/>' for k in range(count + 1))
    joint = '<joint name="j{}" type="fixed"><parent link="{}"/><child link="{}"/></joint>'
    joints = "".join(joint.format(k, k, k + 1) for k in range(count))
    path.write_text(f'<robot name="long">{links}{joints}</robot>')
    assert Urdf(path).chain(str(count)) == ()
    circle = joint.format("back", count, 5)
    path.write_text(f'<robot name="circle">{links}{joints}{circle}</robot>')
    with pytest.raises(ValueError, match=r"'jback'.*circle"):
        Urdf(path).chain(str(count))


@pytest.mark.parametrize("robot", [UR5, PANDA], ids=lambda robot: robot.name)
def test_joints_beside_the_way_to_the_flange_do_not_count(robot: Robot):
    arm, kinematics = Urdf(robot.path), UrdfKinematics(robot.path, robot.flange, STILL, STILL)
    chain = arm.chain(robot.flange)
    assert len(chain) == robot.joint_count
    low, high = kinematics.joint_range
    joints = low + np.linspace(0.3, 0.6, len(chain)) * (high - low)
    above = {child: (parent, pose) for parent, child, pose in arm.link_poses(chain, joints)}
    link, found = robot.flange, STILL
    while link in above:
        link, pose = above[link]
        found = pose @ found
    expected = kinematics.flange(joints)
    np.testing.assert_allclose(found.position, expected.position, atol=1e-9)


def test_a_link_that_is_missing_is_named():
    with pytest.raises(ValueError, match="no link 'hand'"):
        Urdf(CR5_URDF).chain("hand")


def test_a_file_that_is_no_urdf_is_named(tmp_path: Path):
    (tmp_path / "a.urdf").write_text("not xml")
    with pytest.raises(ValueError, match=r"a\.urdf"):
        Urdf(tmp_path / "a.urdf")

"""Kinematics and sphere covers from URDF files: a UR5 and a Panda."""

from __future__ import annotations

import os
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]
import pytest

from lariat.arms.kinematics import UrdfKinematics, load_arm
from lariat.arms.urdf import Urdf
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from tests.robots import PANDA, UR5, Robot

BASE = Pose(np.array([0.1, -0.2, 0.05]), poses.normalized(np.array([0.8, 0.0, 0.1, 0.6])))
TOOL = Pose(np.array([0.0, 0.02, 0.12]), poses.normalized(np.array([0.5, 0.5, 0.1, 0.0])))


@pytest.fixture(scope="module", params=[UR5, PANDA], ids=lambda robot: robot.name)
def robot(request: pytest.FixtureRequest) -> Robot:
    return request.param


@pytest.fixture(scope="module")
def arm(robot: Robot) -> UrdfKinematics:
    return UrdfKinematics(robot.path, robot.flange, BASE, TOOL)


def usual_joints(arm: UrdfKinematics) -> np.ndarray:
    """Joint angles away from limits and singularities."""
    low, high = np.clip(arm.joint_range, -np.pi, np.pi)
    return 0.5 * (low + high) + 0.2 * (high - low) * np.cos(1.0 + np.arange(arm.joint_count))


def test_joints_of_a_grip_pose_reach_it(arm: UrdfKinematics):
    joints = usual_joints(arm)
    grip = arm.grip(joints)
    found = arm.solve(grip, joints + 0.1)
    assert found is not None
    reached = arm.grip(found)
    np.testing.assert_allclose(reached.position, grip.position, atol=1e-6)
    assert abs(abs(reached.orientation @ grip.orientation) - 1.0) < 1e-9


def test_joint_speeds_move_the_grip_with_the_twist(arm: UrdfKinematics):
    joints, dt = usual_joints(arm), 1e-6
    twist = np.array([[0.1, -0.05, 0.08], [0.2, 0.3, -0.1]])
    before = arm.grip(joints)
    after = arm.grip(joints + dt * arm.joint_speed(joints, twist))
    turned = poses.logarithm(poses.multiply(after.orientation, poses.conjugate(before.orientation)))
    np.testing.assert_allclose((after.position - before.position) / dt, twist[0], atol=1e-5)
    np.testing.assert_allclose(turned / dt, twist[1], atol=1e-5)


def test_a_wrench_has_the_same_power_about_flange_and_grip(arm: UrdfKinematics):
    flange = arm.flange(usual_joints(arm))
    twist = np.array([[0.1, -0.05, 0.08], [0.2, 0.3, -0.1]])
    wrench = np.array([[3.0, -2.0, 5.0], [0.4, 0.1, -0.7]])
    power = np.sum(arm.grip_wrench(wrench, flange) * arm.grip_velocity(twist, flange))
    assert power == pytest.approx(np.sum(wrench * twist))
    torque = arm.grip_wrench(wrench, flange)[1]
    assert not np.allclose(torque, poses.rotate(BASE.orientation, wrench[1]))


def test_a_path_changed_in_place_is_another_path(arm: UrdfKinematics):
    path = usual_joints(arm)[None].copy()
    before, _ = arm.link_spheres(path)
    path += 0.1
    after, _ = arm.link_spheres(path)
    np.testing.assert_array_equal(after, arm.link_spheres(usual_joints(arm)[None] + 0.1)[0])
    assert np.max(np.abs(after - before)) > 1e-3


def test_jacobians_are_the_derivatives_of_grip_and_spheres(arm: UrdfKinematics):
    joints, step = usual_joints(arm), 1e-6
    twists, centres = arm.grip_jacobian(joints), arm.link_sphere_jacobians(joints)
    before, spheres = arm.grip(joints), arm.link_spheres(joints[None])[0][0]
    for k in range(arm.joint_count):
        turned = joints + step * np.eye(arm.joint_count)[k]
        after = arm.grip(turned)
        rotation = poses.multiply(after.orientation, poses.conjugate(before.orientation))
        angular = poses.logarithm(rotation) / step
        np.testing.assert_allclose(
            (after.position - before.position) / step, twists[:3, k], atol=1e-5
        )
        np.testing.assert_allclose(angular, twists[3:, k], atol=1e-5)
        moved = (arm.link_spheres(turned[None])[0][0] - spheres) / step
        np.testing.assert_allclose(moved, centres[:, :, k], atol=1e-5)


def test_paths_have_the_singular_values_and_spheres_of_their_poses(arm: UrdfKinematics):
    path = usual_joints(arm) + np.linspace(-0.4, 0.4, 5)[:, None]
    expected = [np.linalg.svd(arm.jacobian(joints), compute_uv=False)[-1] for joints in path]
    np.testing.assert_allclose(arm.smallest_singular_values(path), expected, atol=1e-12)
    centres, _ = arm.link_spheres(path)
    for joints, row in zip(path, centres, strict=True):
        np.testing.assert_allclose(row, arm.link_spheres(joints[None])[0][0], atol=1e-12)


def test_the_start_keeps_away_from_the_joint_limits(arm: UrdfKinematics):
    grip = arm.grip(usual_joints(arm))
    joints = arm.solve_anywhere(grip)
    assert joints is not None
    low, high = arm.joint_range
    assert np.all((joints > low + 0.05) & (joints < high - 0.05))


ARM_WITH_A_MESH = """<robot name="arm">
<link name="base"/>
<link name="tip"><collision><geometry>
<mesh filename="package://arm_meshes/tip.obj"/>
</geometry></collision></link>
<joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
<limit lower="-1" upper="1" velocity="1" effort="1"/></joint>
</robot>"""


def test_joints_of_a_redundant_arm_depend_on_the_pose_and_not_on_the_way():
    arm = UrdfKinematics(PANDA.path, PANDA.flange, BASE, TOOL)
    start = usual_joints(arm)
    arm.posture = start
    grip = arm.grip(start)
    goal = Pose(grip.position + np.array([0.03, 0.1, -0.05]), grip.orientation)
    direct = arm.solve(goal, start)
    joints = start
    for share in np.linspace(0.0, 2.0 * np.pi, 80):
        # A way round, which would leave other joint angles behind without a posture.
        aside = 0.08 * np.array([np.sin(share), 1.0 - np.cos(share), np.sin(2.0 * share)])
        joints = arm.solve(Pose(grip.position + aside, grip.orientation), joints)
        assert joints is not None
    around = arm.solve(goal, joints)
    assert direct is not None
    assert around is not None
    np.testing.assert_allclose(around, direct, atol=2e-3)


def test_spheres_cover_every_corner_of_the_collision_bodies(robot: Robot, arm: UrdfKinematics):
    folders = [str(folder) for folder in robot.path.parents]
    kind = pinocchio.GeometryType.COLLISION
    geometry = pinocchio.buildGeomFromUrdf(arm.model, str(robot.path), kind, package_dirs=folders)
    joints = usual_joints(arm)
    data = arm.model.createData()
    pinocchio.forwardKinematics(arm.model, data, joints)
    centres, radii = arm.link_spheres(joints[None])
    checked = 0
    for body in geometry.geometryObjects:
        if body.parentJoint == 0 or body.name.startswith(("panda_hand", "panda_left", "panda_ri")):
            continue
        placement = data.oMi[body.parentJoint] * body.placement
        shape = body.geometry
        if hasattr(shape, "num_vertices"):
            corners = np.array([shape.vertex(k) for k in range(shape.num_vertices)])
        else:
            half = np.array(shape.halfSide)
            corners = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).reshape(3, -1).T * half
        world = BASE.apply(corners @ np.array(placement.rotation).T + placement.translation)
        gaps = np.linalg.norm(world[:, None] - centres[0], axis=2) - radii
        assert np.max(np.min(gaps, axis=1)) < 1e-9, body.name
        checked += len(corners)
    assert checked > 500


def test_what_cannot_be_an_arm_is_refused_by_name(tmp_path: Path):
    with pytest.raises(ValueError, match=r"none\.urdf"):
        UrdfKinematics(tmp_path / "none.urdf", "tool0", BASE, TOOL)
    with pytest.raises(ValueError, match=r"flange.*tool0"):
        UrdfKinematics(UR5.path, "flange", BASE, TOOL)
    sliding = tmp_path / "sliding.urdf"
    sliding.write_text(
        '<robot name="r"><link name="base"/><link name="tool"/><joint name="turn" '
        'type="prismatic"><parent link="base"/><child link="tool"/><axis xyz="0 0 1"/>'
        '<limit lower="0" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    with pytest.raises(ValueError, match=r"turn.*prismatic"):
        UrdfKinematics(sliding, "tool", BASE, TOOL)
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot")
    with pytest.raises(ValueError, match="is not a URDF"):
        UrdfKinematics(broken, "tool", BASE, TOOL)


LIMIT = '<limit lower="-1" upper="1" effort="1" velocity="1"/>'


@pytest.mark.parametrize(
    ("joint", "reason"),
    [
        ('<axis xyz="0 0 0"/>' + LIMIT, "joint 'turn': axis .* is no direction"),
        (LIMIT.replace('"1" e', '"-2" e'), "from lower = -1 to upper = -2 rad"),
        (LIMIT.replace("1", "180"), "limits are in radians"),
        (LIMIT + '<mimic joint="other"/>', "mimics 'other'"),
        ("", "has no limits"),
        (LIMIT + '<origin xyz="${x} 0 0"/>', "is a xacro file; expand it"),
        (LIMIT + '<mesh filename="$(find arm)/a.stl"/>', "is a xacro file; expand it"),
        (LIMIT + '<origin xyz="0 0 128.3"/>', "in metres, not millimetres"),
        (LIMIT.replace('"-1"', '"-180 deg"'), "lower = '-180 deg' is no number"),
        (LIMIT.replace('"-1"', '"nan"'), "from lower = nan"),
        (LIMIT + '<origin xyz="a 0 0"/>', "joint 'turn': could not convert"),
    ],
)
def test_a_mistake_in_a_joint_is_named(tmp_path: Path, joint: str, reason: str):
    path = tmp_path / "arm.urdf"
    path.write_text(
        '<robot name="r"><link name="base"/><link name="tool"/><joint name="turn" type="revolute">'
        f'<parent link="base"/><child link="tool"/>{joint}</joint></robot>'
    )
    with pytest.raises(ValueError, match=reason):
        UrdfKinematics(path, "tool", BASE, TOOL)


def test_a_limit_without_effort_and_speed_has_usual_ones(tmp_path: Path):
    path = tmp_path / "arm.urdf"
    joint = '<parent link="base"/><child link="tool"/><limit lower="-1" upper="1" velocity="0"/>'
    path.write_text(
        '<robot name="r"><link name="base"/><link name="tool"/>'
        f'<joint name="turn" type="revolute">{joint}</joint></robot>'
    )
    model, _ = load_arm(path, "tool")
    assert model.velocityLimit[0] > 0.0
    assert model.effortLimit[0] > 0.0


@pytest.mark.parametrize(
    ("parts", "flange", "reason"),
    [
        ('<link name="loose"/>', "tip", r"root links.*loose"),
        ('<link name="tip"/>', "tip", r"'tip' is not unique"),
        ("", "base", r"no joint of .* moves 'base'"),
    ],
)
def test_a_wrong_tree_is_refused_without_a_word_of_the_parser(
    parts: str, flange: str, reason: str, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM_WITH_A_MESH.replace("</robot>", f"{parts}</robot>"))
    with pytest.raises(ValueError, match=reason):
        load_arm(path, flange)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize(
    ("mesh", "reason"),
    [
        ("v 0 0 0\nv 100 0 0\nv 0 100 0\nv 0 0 9\nf 1 2 3\nf 1 2 4\n", r"tip\.obj is 100 m.*scale"),
        ("", r"tip\.obj OBJ-file is too small"),
    ],
)
def test_a_mesh_of_millimetres_or_none_is_refused(mesh: str, reason: str, tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(ARM_WITH_A_MESH)
    (tmp_path / "arm_meshes").mkdir()
    (tmp_path / "arm_meshes/tip.obj").write_text(mesh)
    with pytest.raises(ValueError, match=reason):
        UrdfKinematics(path, "tip", BASE, TOOL)


@pytest.mark.slow
def test_every_robot_of_example_robot_data_loads_or_is_refused_for_a_joint_of_its_chain():
    loaded = 0
    folder = next(parent for parent in UR5.path.parents if parent.name == "robots")
    for path in sorted(folder.rglob("*.urdf")):
        robot = Urdf(path)
        tips = {joint.child for joint in robot.joints} - {joint.parent for joint in robot.joints}
        tip = max(sorted(tips), key=lambda link: len(robot.chain(link)), default="")
        if not tip or not robot.chain(tip):
            continue
        try:
            model, _ = load_arm(path, tip)
        except ValueError as error:
            reason = str(error)
        else:
            reason = ""
            loaded += 1
            assert model.nq == len(robot.chain(tip)), path
        assert not reason or any(f"joint '{joint.name}'" in reason for joint in robot.joints), (
            reason
        )
    assert loaded > 40


def test_a_joint_without_limits_turns_once_in_each_direction(tmp_path: Path):
    text = UR5.path.read_text()
    tree = ElementTree.fromstring(text)
    name = "shoulder_pan_joint"
    joint = next(j for j in tree.iter("joint") if j.get("name") == name and j.get("type"))
    joint.set("type", "continuous")
    joint.remove(joint.find("limit"))
    for link in tree.iter("link"):
        for part in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(part)
    path = tmp_path / "arm.urdf"
    path.write_text(ElementTree.tostring(tree, encoding="unicode"))
    here = Pose(np.zeros(3), poses.IDENTITY)
    arm = UrdfKinematics(path, UR5.flange, here, here)
    nominal = UrdfKinematics(UR5.path, UR5.flange, here, here)
    assert arm.model.upperPositionLimit[0] == pytest.approx(2.0 * np.pi)
    assert arm.model.lowerPositionLimit[0] == pytest.approx(-2.0 * np.pi)
    joints = np.array([0.3, -1.0, 1.2, -0.4, 0.5, 0.1])
    np.testing.assert_allclose(arm.grip(joints).position, nominal.grip(joints).position)


@pytest.mark.parametrize(
    ("name", "inside"), [("ROS_PACKAGE_PATH", ""), ("AMENT_PREFIX_PATH", "share")]
)
def test_meshes_of_packages_elsewhere_are_found_as_ros_finds_them(
    name: str, inside: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    urdf, installed = tmp_path / "robot" / "arm.urdf", tmp_path / "installed"
    package = installed / inside / "arm_meshes"
    urdf.parent.mkdir()
    package.mkdir(parents=True)
    urdf.write_text(ARM_WITH_A_MESH)
    (package / "tip.obj").write_text("v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 2 3\nf 1 2 4\n")
    for variable in ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH"):
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(ValueError, match=r"tip\.obj.*PACKAGE_PATH"):
        load_arm(urdf, "tip")
    monkeypatch.setenv(name, f"{tmp_path}{os.pathsep}{installed}")
    _, geometry = load_arm(urdf, "tip")
    assert len(geometry.geometryObjects) == 1

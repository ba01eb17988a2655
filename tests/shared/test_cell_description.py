"""Description of a cell: one URDF that other software reads."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio  # pyright: ignore[reportMissingImports]  # its wheel lives beside site-packages
import pytest

from lariat.arms.cr5_installation import kinematics_of
from lariat.arms.description import with_own_urdfs
from lariat.geometry import poses
from lariat.protocols import ArmFacts
from lariat.scenario import SIDES, find, load
from lariat.scenario.settings import load_with
from shared.cell_description import arm_urdf, cell_urdf, frame_name
from tests.robots import PANDA, UR5, Robot


def test_pinocchio_reads_two_arms_at_their_places():
    scenario = load(find("two-arms"))
    model = pinocchio.buildModelFromXML(cell_urdf(scenario))
    joints = np.random.default_rng(0).uniform(-1.0, 1.0, 6)
    q = pinocchio.neutral(model)
    for side in SIDES:
        for k, value in enumerate(joints):
            joint = model.joints[model.getJointId(frame_name(side, f"joint_{k + 1}"))]
            q[joint.idx_q] = value
    data = model.createData()
    pinocchio.framesForwardKinematics(model, data, q)
    for side in SIDES:
        end = scenario.end(side)
        found = data.oMf[model.getFrameId(frame_name(side, "link_6"))].translation
        flange = kinematics_of(end).flange(joints)
        base = np.array(end.base_position)
        turned = poses.rotate(poses.normalized(np.array(end.base_orientation)), flange.position)
        np.testing.assert_allclose(found, base + turned, atol=1e-6)


def test_an_ideal_end_is_a_gripper_that_floats():
    model = pinocchio.buildModelFromXML(cell_urdf(load(find("three-cylinders"))))
    assert list(model.names)[1:] == ["left/grip", "right/grip"]
    assert model.nq == 14


@pytest.mark.parametrize("robot", [UR5, PANDA], ids=lambda robot: robot.name)
def test_any_arm_is_described_without_the_files_of_its_meshes(robot: Robot):
    text = cell_urdf(load_with(find("fixed-end"), robot.settings("right")))
    assert "mesh" not in text
    model = pinocchio.buildModelFromXML(text)
    assert model.existFrame(frame_name("right", robot.flange))


class Branded:
    """Arm that brings its own URDF."""

    facts = ArmFacts(urdf=UR5.path, flange=UR5.flange, simulated=True)


def test_an_arm_that_brings_its_urdf_is_described_where_a_person_has_named_it():
    named = f"ends.right.driver={__name__}:Branded"
    scenario = load_with(find("three-cylinders"), [named])
    assert arm_urdf(scenario, "right") is None
    stated = with_own_urdfs(scenario)
    assert arm_urdf(stated, "right") is not None
    assert frame_name("right", UR5.flange) in cell_urdf(stated)


def test_an_arm_whose_file_is_elsewhere_is_left_out():
    scenario = load_with(find("fixed-end"), UR5.settings("right"))
    end = replace(scenario.ends.right, urdf="elsewhere.urdf")
    moved = replace(scenario, ends=replace(scenario.ends, right=end))
    assert "right/grip" in cell_urdf(moved)
    assert frame_name("right", UR5.flange) not in cell_urdf(moved)

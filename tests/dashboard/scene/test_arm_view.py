"""Arm in the scene: its bodies stand where Pinocchio places the links."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from dashboard.scene.arm_view import arm_view
from lariat.arms.kinematics import UrdfKinematics
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, load
from lariat.scenario.placement import base_of, tool_of
from lariat.scenario.settings import load_with
from tests.closed_loop.loop import SCENARIOS
from tests.robots import PANDA, UR5, Robot


class Scene:
    """Stand-in for the page's scene, which keeps what is added."""

    def __init__(self) -> None:
        self.bodies: dict[str, Any] = {}

    def add_mesh_simple(self, name: str, vertices: Any, faces: Any, **look: Any) -> Any:
        self.bodies[name] = SimpleNamespace(vertices=vertices, faces=faces, **look)
        return self.bodies[name]


def cell(robot: Robot) -> Scenario:
    return load_with(SCENARIOS / "fixed-end.toml", robot.settings("right"))


@pytest.mark.parametrize("robot", [UR5, PANDA], ids=lambda robot: robot.name)
def test_bodies_lie_within_the_spheres_of_the_gateway(robot: Robot):
    scene, scenario = Scene(), cell(robot)
    view = arm_view(scene, scenario, "right")
    assert view is not None
    assert not any(body.visible for body in scene.bodies.values())
    end = scenario.ends.right
    arm = UrdfKinematics(robot.path, robot.flange, base_of(end), tool_of(end))
    low, high = np.clip(arm.joint_range, -np.pi, np.pi)
    joints = 0.6 * low + 0.4 * high
    view.update(joints)
    spheres, radii = arm.link_spheres(joints[None])
    centres = np.concatenate([spheres[0], arm.base_spheres[0]])
    radii = np.concatenate([radii, arm.base_spheres[1]])
    assert len(scene.bodies) > 6
    for name, body in scene.bodies.items():
        assert body.visible
        assert np.max(body.faces) < len(body.vertices)
        pose = Pose(np.array(body.position), np.array(body.wxyz))
        world = pose.apply(np.array(body.vertices))
        gaps = np.linalg.norm(world[:, None] - centres, axis=2) - radii
        assert np.max(np.min(gaps, axis=1)) < 1e-6, name


def test_a_cr5_is_drawn_and_an_ideal_end_is_not():
    scenario = load("fixed-end")
    assert arm_view(Scene(), scenario, "left") is None
    scene = Scene()
    view = arm_view(scene, scenario, "right")
    assert view is not None
    view.update(np.zeros(3))
    assert not any(body.visible for body in scene.bodies.values())
    view.update(np.zeros(6))
    assert all(body.visible for body in scene.bodies.values())


def test_a_urdf_of_another_machine_leaves_the_arm_out():
    scenario = cell(UR5)
    gone = replace(scenario.ends.right, urdf="/nowhere/arm.urdf")
    scenario = replace(scenario, ends=replace(scenario.ends, right=gone))
    assert arm_view(Scene(), scenario, "right") is None

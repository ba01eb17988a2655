"""Bodies of arms in a film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.arms.installation import kinematics_of
from lariat.geometry.obstacles import signed_distance
from lariat.scenario import Scenario, load
from lariat.scenario.settings import load_with
from lariat.scenario.shipped import find
from shared.video.arm_bodies import arm_bodies
from tests.robots import PANDA, UR5, Robot

BENT = np.array([0.3, -0.8, 1.2, -1.4, 1.1, 0.9, 0.2])


def cell_with(robot: Robot) -> Scenario:
    return load_with(Path("three-cylinders"), robot.settings("left"))


@pytest.mark.parametrize(
    "scenario",
    [
        pytest.param(load(find("two-arms")), id="cylinders"),
        pytest.param(cell_with(UR5), id="UR5"),
        pytest.param(cell_with(PANDA), id="Panda"),
    ],
)
def test_the_bodies_hold_the_spheres_of_the_kinematics(scenario: Scenario):
    kinematics, bodies = kinematics_of(scenario, "left"), arm_bodies(scenario, "left")
    assert kinematics is not None
    assert bodies is not None
    joints = BENT[: kinematics.joint_count]
    centres = kinematics.link_spheres(joints[None])[0][0]
    drawn = bodies.at(joints)
    assert np.max(np.min([signed_distance(centres, body) for body in drawn], axis=0)) < 0.0
    # A mesh is drawn by the very spheres that cover it.
    known = np.concatenate([centres, kinematics.base_spheres[0]])
    for body in drawn:
        if body.shape == "sphere":
            assert np.linalg.norm(known - body.position, axis=1).min() < 1e-9


def test_no_body_is_drawn_without_every_joint():
    bodies = arm_bodies(load(find("two-arms")), "left")
    assert bodies is not None
    assert bodies.at(np.zeros(3)) == ()


def test_an_end_without_an_arm_has_no_bodies():
    assert arm_bodies(load(find("three-cylinders")), "left") is None

"""Bodies of arms in a film."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.obstacles import signed_distance
from shared.arms.installation import kinematics_of
from shared.film.arm_bodies import arm_bodies
from shared.scenario import Scenario, load
from shared.scenario.shipped import find
from stack.scenario_overrides import load_with
from tests.robots import UR5

BENT = np.array([0.3, -0.8, 1.2, -0.4, 1.1, 0.2])


@pytest.mark.parametrize(
    "scenario",
    [
        pytest.param(load(find("two-arms")), id="cylinders"),
        pytest.param(load_with(Path("three-cylinders"), UR5.settings("left")), id="meshes"),
    ],
)
def test_the_bodies_hold_the_spheres_of_the_kinematics(scenario: Scenario):
    kinematics, bodies = kinematics_of(scenario, "left"), arm_bodies(scenario, "left")
    assert kinematics is not None
    assert bodies is not None
    for joints in (np.zeros(6), BENT):
        centres = kinematics.link_spheres(joints[None])[0][0]
        distances = [signed_distance(centres, body) for body in bodies.at(joints)]
        assert np.max(np.min(distances, axis=0)) < 0.0
        # A mesh is drawn by the very spheres that cover it.
        spheres = [body.position for body in bodies.at(joints) if body.shape == "sphere"]
        if spheres:
            gaps = np.linalg.norm(centres[:, None] - np.array(spheres), axis=2)
            assert np.max(np.min(gaps, axis=1)) < 1e-9


def test_no_body_is_drawn_without_every_joint():
    bodies = arm_bodies(load(find("two-arms")), "left")
    assert bodies is not None
    assert bodies.at(np.zeros(3)) == ()


def test_an_end_without_an_arm_has_no_bodies():
    assert arm_bodies(load(find("three-cylinders")), "left") is None

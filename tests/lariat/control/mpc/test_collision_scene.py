"""Obstacles that the horizon keeps clear of: those of the scene, and other ropes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.control.mpc.collision_scene import GOAL_CLEARANCE_TOLERANCE, CollisionScene
from lariat.geometry.grippers import axis_clearance
from lariat.geometry.obstacles import Obstacle
from lariat.rope_controller import RopeController
from lariat.scenario import load

SCENARIO = load(Path(__file__).parents[4] / "scenarios" / "three-cylinders.toml")


def test_other_ropes_are_avoided_and_stay_when_the_scene_changes() -> None:
    scene = CollisionScene(SCENARIO)
    rope = Obstacle("capsule", (0.0, 0.0, 0.3), radius=0.005, height=0.1, name="other rope 1")
    scene.update_others((rope,), 1)
    assert scene.avoided == (*SCENARIO.bodies, rope)
    scene.update(SCENARIO.bodies[:1], 5)
    assert scene.avoided == (SCENARIO.bodies[0], rope)
    scene.update_others((), 2)
    assert scene.avoided == SCENARIO.bodies[:1]


def test_a_goal_on_another_rope_does_not_lower_the_clearance_from_it() -> None:
    task = RopeController(SCENARIO).task
    before = CollisionScene(SCENARIO).avoidance(task, 0.0)
    scene = CollisionScene(SCENARIO)
    middle = tuple(task.goal.nodes[20].tolist())
    scene.update_others((Obstacle("sphere", middle, radius=0.01, name="other rope 1"),), 1)
    beside = scene.avoidance(task, 0.0)
    assert len(beside.obstacles) == len(before.obstacles) + 1
    assert beside.clearance == before.clearance
    assert beside.gripper_clearance == before.gripper_clearance


@pytest.mark.parametrize("distance", [0.0172, 0.5])
def test_a_body_beside_a_goal_lowers_the_clearance_of_the_grippers(distance: float) -> None:
    task = RopeController(SCENARIO).task
    limits = SCENARIO.limits
    usual = axis_clearance(limits.gripper_radius, limits.keep_out)
    scene = CollisionScene(SCENARIO)
    radius = 0.01
    # Above the left gripper, so that its axis is as near as the grip.
    centre = np.add(task.goal.left.position, (0.0, 0.0, distance + radius))
    scene.update((Obstacle("sphere", tuple(centre.tolist()), radius=radius, name="lamp"),), 5)
    own = scene.avoidance(task, 0.0).gripper_clearance
    expected = min(usual, distance - GOAL_CLEARANCE_TOLERANCE)
    assert own == pytest.approx(expected, abs=1e-9)

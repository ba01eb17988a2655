"""Consent to the approach: named, held, and never assumed."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.poses import Pose
from tests.services.robot_gateway.arm_cell import GRIPS, ArmWorld
from tests.services.robot_gateway.test_faults import slowed_after

AWAY = Pose(GRIPS[1].position + np.array([0.02, 0.06, 0.04]), GRIPS[1].orientation)


@pytest.fixture
def world() -> ArmWorld:
    """A disarmed cell whose arm is 75 mm from the start."""
    world = ArmWorld("v4", automatic=False, begin=AWAY)
    world.run(0.3)
    assert world.report.needs_approach
    return world


def test_arming_again_is_no_consent(world: ArmWorld) -> None:
    for _ in range(3):
        assert "75 mm and 0.00 rad from the start" in world.command("arm")
        assert world.mode == "disarmed"


@pytest.mark.parametrize("named", [{"distance": 0.334}, {"distance": 0.0}, {"angle": 0.1}])
def test_approach_that_names_another_way_is_refused(world: ArmWorld, named: dict) -> None:
    assert "look again" in world.command("approach", **named)
    assert world.mode == "disarmed"
    assert not world.emulator.controller.enabled


def test_approach_stops_with_the_signs_of_life_and_goes_on_by_another_one(
    world: ArmWorld,
) -> None:
    assert world.approach() == ""
    while np.linalg.norm(world.measured[-1] - AWAY.position) < 0.03:
        world.step()
    world.held_command = ""
    let_go = world.seconds
    world.run(0.5)
    assert slowed_after(world, let_go) <= 0.15
    assert world.report.safety.cause == "consent"
    rest = world.measured[-1]
    left = float(np.linalg.norm(rest - GRIPS[1].position))
    assert 0.02 < left < 0.05
    # Nothing but another approach goes on, and it names what is left.
    for action in ("arm", "acknowledge", "resume"):
        assert world.command(action) != ""
    world.follow(lambda t: rest + np.array([0.0, 0.02 * t, 0.0]), 0.5)
    np.testing.assert_allclose(world.measured[-1], rest, atol=1e-4)
    assert np.isclose(world.report.approach_distance, left, atol=1e-4)
    assert world.approach() == ""
    world.run(4.0)
    np.testing.assert_allclose(world.measured[-1], GRIPS[1].position, atol=1e-3)
    assert (world.mode, world.report.approaching) == ("armed", False)


def test_signs_of_life_for_another_command_keep_nothing_going(world: ArmWorld) -> None:
    assert world.command("approach") == ""
    world.held_command = "command-of-a-stranger"
    world.run(2.0)
    assert world.report.safety.cause == "consent"
    np.testing.assert_allclose(world.measured[-1], AWAY.position, atol=1e-3)


@pytest.mark.parametrize("action", ["hold", "disarm"])
def test_stop_by_a_person_leaves_no_arm_armed_on_its_way(world: ArmWorld, action: str) -> None:
    assert world.approach() == ""
    while np.linalg.norm(world.measured[-1] - AWAY.position) < 0.03:
        world.step()
    assert world.command(action) == ""
    world.run(0.5)
    rest = world.measured[-1]
    world.command("acknowledge")
    assert world.command("resume") != ""
    assert world.command("arm") != ""
    world.follow(lambda t: rest + np.array([0.0, 0.02 * t, 0.0]), 0.5)
    np.testing.assert_allclose(world.measured[-1], rest, atol=1e-4)
    assert world.report.needs_approach
    assert world.approach() == ""
    world.run(4.0)
    np.testing.assert_allclose(world.measured[-1], GRIPS[1].position, atol=1e-3)
    assert world.mode == "armed"

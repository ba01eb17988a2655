"""Contact force limit: a rope shorter than the scenario states stops the arm."""

from __future__ import annotations

import numpy as np
import pytest

from tests.services.robot_gateway.arm_cell import BASE, GRIPS, TOOL, ArmWorld
from tests.services.robot_gateway.cells import smooth_step

SPAN = float(np.linalg.norm(GRIPS[1].position - GRIPS[0].position))
LENGTH, STIFFNESS = SPAN + 0.02, 3000.0
OUT = (GRIPS[1].position - GRIPS[0].position) / SPAN


def tethered(firmware: str, noise: float = 0.0) -> ArmWorld:
    """Return an arm whose rope is 3 m long by the scenario but short in the emulator."""
    anchor = (BASE.inverse() @ GRIPS[0]).position
    tether = (*anchor, LENGTH, STIFFNESS, *TOOL.position)
    world = ArmWorld(firmware, tether=tether, force_noise=noise)
    world.until_ready()
    return world


def away(world: ArmWorld, distance: float) -> None:
    """Follow setpoints outwards along the rope from the present pose, to rest."""
    here = world.cell.follower.state.positions[0].copy()
    since = world.now
    world.follow(lambda t: here + distance * smooth_step(t, 1.0) * OUT, 1.4, since)


def felt(world: ArmWorld) -> np.ndarray:
    """Force and torque on the right gripper, in the world [N, N m]."""
    wrench = world.cell.arms.feedback[1].wrench
    assert wrench is not None
    return wrench


def stretch(world: ArmWorld) -> float:
    """Return the extension of the tether [m]."""
    return float(np.linalg.norm(world.measured[-1] - GRIPS[0].position)) - LENGTH


@pytest.mark.parametrize("firmware", ["v3", "v4"])
def test_taut_rope_stops_the_arm_and_may_only_be_relieved(firmware: str) -> None:
    world = tethered(firmware, noise=1.0)
    away(world, 0.012)
    assert world.mode in ("moving", "armed"), "a slack rope is not felt"
    away(world, 0.05)
    world.run(0.5)
    assert (world.mode, world.report.safety.cause) == ("holding", "pulled"), world.report
    assert world.report.rule == "overstretch"
    assert "right feels" in world.report.safety.detail
    assert 20.0 / STIFFNESS < stretch(world) < 0.03
    force, torque = felt(world)
    # Noise of 1 N; a force at the grip has no torque about it.
    np.testing.assert_allclose(force, -STIFFNESS * stretch(world) * OUT, atol=6.0)
    np.testing.assert_allclose(torque, 0.0, atol=1.0)
    # A person acknowledges; it may not get worse, but better.
    world.go_on()
    world.run(0.3)
    before = stretch(world)
    away(world, 0.05)
    world.run(0.3)
    assert world.report.safety.cause == "pulled"
    assert stretch(world) < before + 0.012
    world.go_on()
    world.run(0.3)
    away(world, -0.05)
    assert world.mode in ("moving", "armed"), world.report
    assert stretch(world) < -0.01
    assert world.report.arms[1].contact_force < 6.0


def test_weight_of_arm_and_tool_is_no_contact_force() -> None:
    world = tethered("v4")
    bias = np.array([[0.0, 0.0, -55.0], [0.0, 0.0, 0.0]])
    plain = world.emulator.feedback._wrench
    world.emulator.feedback._wrench = lambda: plain() + bias
    assert world.command("disarm") == ""
    world.run(0.2)
    assert world.command("arm") == ""
    world.until_ready()
    away(world, 0.012)
    assert world.report.arms[1].contact_force < 1.0
    assert world.mode in ("moving", "armed"), world.report

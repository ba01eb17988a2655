"""Simulated arm in MuJoCo: lag, torque limit, brakes and gripper."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.protocols import ArmReading, ArmSetup
from services.robot_gateway.drivers.simulated import SimulatedArm, SimulatedArmSettings
from tests.robots import PANDA, UR5, Robot

TICK = 0.008


class World:
    """Arm and its clock."""

    def __init__(self, robot: Robot, settings: SimulatedArmSettings | None = None) -> None:
        self.start = np.array([0.3, -1.0, 1.2, -0.5, 1.0, 0.2, 0.1][: robot.joint_count])
        if robot is PANDA:
            self.start = np.array([0.3, -0.5, 0.2, -1.8, 0.1, 1.6, 0.4])
        setup = ArmSetup("right", "", robot.path, robot.flange, self.start, 1.6)
        self.arm, self.time = SimulatedArm(setup, settings), 1.0

    def step(self, target: np.ndarray | None = None, ticks: int = 1) -> ArmReading:
        readings = []
        for _ in range(ticks):
            self.time += TICK
            readings.append(self.arm.step(self.time, target))
        return readings[-1]


@pytest.mark.parametrize("robot", [UR5, PANDA], ids=lambda robot: robot.name)
def test_every_joint_follows_a_ramp_with_the_lag_of_servo_and_position_loop(robot: Robot):
    world, settings = World(robot), SimulatedArmSettings()
    world.arm.enable()
    world.step(ticks=60)
    speed, ticks = 0.3, 125
    readings = [world.step(world.start + speed * k * TICK) for k in range(1, ticks + 1)]
    reading = readings[-1]
    assert reading.joints is not None
    assert reading.velocities is not None
    behind = world.start + speed * ticks * TICK - reading.joints
    lag = settings.servo_lag + 2.0 / settings.bandwidth
    np.testing.assert_allclose(behind, speed * lag, atol=0.15 * speed * lag)
    np.testing.assert_allclose(reading.velocities, speed, atol=0.01)


def test_no_joint_turns_with_more_than_its_torque():
    weak = World(UR5, SimulatedArmSettings(servo_lag=0.001, bandwidth=400.0))
    weak.arm.enable()
    weak.step(ticks=60)
    wanted = weak.start.copy()
    wanted[0] += 0.5
    reading = weak.step(wanted, ticks=2)
    # 150 N m cannot turn the first joint by half a radian in 16 ms.
    assert reading.joints is not None
    assert 0.0 < reading.joints[0] - weak.start[0] < 0.1


def test_an_arm_without_power_stands_under_its_weight_and_ignores_targets():
    world = World(PANDA)
    reading = world.step(world.start + 0.2, ticks=125)
    assert not reading.ready
    assert not reading.powered
    np.testing.assert_allclose(reading.joints, world.start, atol=1e-3)


def test_power_taken_in_motion_stops_the_arm():
    world = World(UR5)
    world.arm.enable()
    assert world.step(ticks=10).mode == "powering on"
    world.step(ticks=60)
    moving = [world.step(world.start + 0.3 * k * TICK) for k in range(30)][-1]
    world.arm.disable()
    stopped = world.step(ticks=2)
    later = world.step(ticks=50)
    assert moving.velocities is not None
    assert np.max(moving.velocities) > 0.2
    np.testing.assert_allclose(later.joints, stopped.joints, atol=1e-3)


def test_the_gripper_takes_time_to_open_and_close():
    world = World(UR5)
    assert world.step(ticks=20).gripper_closed
    world.arm.set_gripper(False)
    assert not world.step().gripper_closed
    world.step(ticks=60)
    world.arm.set_gripper(True)
    assert not world.step(ticks=2).gripper_closed
    assert world.step(ticks=100).gripper_closed

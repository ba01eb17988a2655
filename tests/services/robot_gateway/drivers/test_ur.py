"""UR driver against a stand-in for `ur_rtde`, whose names are compared with the real library's."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from lariat.protocols import ArmReading, ArmSetup
from services.robot_gateway.drivers.ur import UrArm

SETUP = ArmSetup("right", "192.0.2.7", Path("ur5.urdf"), "tool0", np.zeros(6), 1.0)


class Robot:
    """State of a robot behind all interfaces of the library."""

    def __init__(self) -> None:
        self.mode, self.safety, self.online = 3, 1, True
        self.joints = np.array([0.1, -1.0, 1.2, 0.0, 0.3, 0.0])
        self.power_takes_long = False
        self.calls: list[tuple[Any, ...]] = []

    @property
    def library(self) -> Any:
        def note(name: str, effect: Callable[[], object] = lambda: None):
            def call(*arguments: Any) -> bool:
                self.calls.append((name, *arguments))
                effect()
                return True

            return call

        def connect(host: str) -> None:
            if not self.online:
                raise RuntimeError(f"no route to {host}")

        def servo(joints: list[float], *more: float) -> bool:
            self.calls.append(("servoJ", joints, *more))
            self.joints = np.array(joints)
            return True

        def put_mode(mode: int) -> Callable[[], None]:
            return lambda: None if self.power_takes_long else setattr(self, "mode", mode)

        def board(host: str) -> Any:
            return SimpleNamespace(
                connect=lambda: connect(host),
                powerOn=note("powerOn", put_mode(5)),
                brakeRelease=note("brakeRelease", put_mode(7)),
                powerOff=note("powerOff", put_mode(3)),
                disconnect=note("disconnect"),
            )

        def receive(host: str) -> Any:
            return SimpleNamespace(
                isConnected=lambda: self.online,
                getRobotMode=lambda: self.mode,
                getSafetyMode=lambda: self.safety,
                getActualQ=lambda: self.joints.tolist(),
                getActualQd=lambda: [0.0] * 6,
                getActualTCPForce=lambda: [1.0, 2.0, -5.0, 0.0, 0.0, 0.0],
                disconnect=note("disconnect"),
            )

        def control(host: str) -> Any:
            return SimpleNamespace(
                isConnected=lambda: self.online,
                servoJ=servo,
                servoStop=note("servoStop"),
                stopScript=note("stopScript"),
                disconnect=note("disconnect"),
            )

        def io(host: str) -> Any:
            return SimpleNamespace(setToolDigitalOut=note("setToolDigitalOut"))

        return SimpleNamespace(
            dashboard_client=SimpleNamespace(DashboardClient=board),
            rtde_receive=SimpleNamespace(RTDEReceiveInterface=receive),
            rtde_control=SimpleNamespace(RTDEControlInterface=control),
            rtde_io=SimpleNamespace(RTDEIOInterface=io),
        )

    def called(self, name: str) -> bool:
        return any(call[0] == name for call in self.calls)


@pytest.fixture
def robot() -> Robot:
    return Robot()


@pytest.fixture
def arm(robot: Robot):
    arm = UrArm(SETUP, robot.library)
    yield arm
    arm.close()


def step_until(
    arm: UrArm, condition: Callable[[ArmReading], object], target: np.ndarray | None = None
) -> ArmReading:
    """Step like the gateway until a reading fulfils a condition."""
    for _ in range(2000):
        reading = arm.step(0.0, target)
        if condition(reading):
            return reading
        time.sleep(0.004)
    raise AssertionError("it never came")


def test_an_arm_that_nobody_enables_is_read_and_not_touched(arm: UrArm, robot: Robot):
    reading = step_until(arm, lambda r: r.joints is not None)
    np.testing.assert_array_equal(reading.joints, robot.joints)
    assert not reading.ready
    assert not reading.powered
    assert robot.calls == []


def test_enabling_takes_power_and_brakes_and_then_it_follows(arm: UrArm, robot: Robot):
    arm.enable()
    reading = step_until(arm, lambda r: r.ready)
    assert reading.powered
    assert robot.called("powerOn")
    assert robot.called("brakeRelease")
    assert not robot.called("servoJ")
    target = robot.joints + 0.01
    step_until(arm, lambda r: np.allclose(r.joints, target), target)
    step_until(arm, lambda r: robot.called("servoStop"), None)
    assert reading.force is not None
    assert reading.force.tolist() == [-1.0, -2.0, -5.0]


def test_targets_that_stop_coming_stop_the_arm(arm: UrArm, robot: Robot):
    arm.enable()
    step_until(arm, lambda r: r.ready)
    step_until(arm, lambda r: robot.called("servoJ"), robot.joints.copy())
    for _ in range(500):
        if robot.called("servoStop"):
            break
        time.sleep(0.01)
    assert robot.called("servoStop")


def test_a_protective_stop_is_a_fault_in_words_and_ends_the_motion(arm: UrArm, robot: Robot):
    arm.enable()
    step_until(arm, lambda r: r.ready)
    step_until(arm, lambda r: robot.called("servoJ"), robot.joints.copy())
    robot.safety = 3
    reading = step_until(arm, lambda r: r.faults, robot.joints.copy())
    assert reading.faults == ("protective stop",)
    assert not reading.ready
    step_until(arm, lambda r: robot.called("servoStop"), robot.joints.copy())


def test_disabling_takes_the_power(arm: UrArm, robot: Robot):
    arm.enable()
    step_until(arm, lambda r: r.ready)
    arm.disable()
    reading = step_until(arm, lambda r: not r.powered)
    assert not reading.ready
    assert robot.called("powerOff")


def test_disabling_takes_power_that_the_robot_has_not_yet_reported(arm: UrArm, robot: Robot):
    step_until(arm, lambda r: r.joints is not None)
    robot.power_takes_long = True
    arm.enable()
    assert arm.step(0.0, None).powered, "an orderly end would not wait"
    step_until(arm, lambda r: robot.called("powerOn"))
    assert robot.mode == 3
    arm.disable()
    step_until(arm, lambda r: robot.called("powerOff"))


def test_a_robot_that_does_not_answer_is_not_connected(robot: Robot):
    robot.online = False
    arm = UrArm(SETUP, robot.library)
    reading = step_until(arm, lambda r: r.faults)
    assert not reading.connected
    assert reading.faults == ("no route to 192.0.2.7",)
    arm.close()


def test_the_names_are_those_of_the_real_library():
    control = pytest.importorskip("rtde_control").RTDEControlInterface
    receive = pytest.importorskip("rtde_receive").RTDEReceiveInterface
    board = pytest.importorskip("dashboard_client").DashboardClient
    io = pytest.importorskip("rtde_io").RTDEIOInterface
    wanted = {
        control: ("servoJ", "servoStop", "stopScript", "disconnect", "isConnected"),
        receive: (
            "isConnected",
            "getRobotMode",
            "getSafetyMode",
            "getActualQ",
            "getActualQd",
            "getActualTCPForce",
            "disconnect",
        ),
        board: ("connect", "powerOn", "brakeRelease", "powerOff", "disconnect"),
        io: ("setToolDigitalOut",),
    }
    for kind, names in wanted.items():
        assert [name for name in names if not hasattr(kind, name)] == []

"""Driver of arms that follow joint angles: the guide's class follows, faulty ones are named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from lariat.arms.kinematics import UrdfKinematics
from lariat.geometry.poses import Pose
from lariat.protocols import ArmFacts, ArmReading, ArmSetup
from lariat.scenario.extensions import Extension
from lariat.scenario.sections import DRIVERS, Limits
from services.robot_gateway.drivers.driver import ArmFeedback
from services.robot_gateway.drivers.joint_arm import JointArmDriver
from tests.own_method_examples import write_examples
from tests.robots import UR5

BASE = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
TOOL = Pose(np.array([0.0, 0.0, 0.12]), np.array([1.0, 0.0, 0.0, 0.0]))
START = Pose(np.array([0.4, 0.1, 0.3]), np.array([0.0, 1.0, 0.0, 0.0]))
TICK = 8_000_000
STILL = np.zeros((2, 3))


@pytest.fixture(scope="module")
def kinematics() -> UrdfKinematics:
    return UrdfKinematics(UR5.path, UR5.flange, BASE, TOOL)


class Scripted:
    """Arm whose next reading the test decides."""

    facts = ArmFacts(simulated=True)

    def __init__(self, joints: np.ndarray) -> None:
        self.reading: object = ArmReading(joints, ready=True)
        self.targets: list[np.ndarray | None] = []
        self.enabled = 0

    def enable(self) -> None:
        self.enabled += 1

    def disable(self) -> None:
        raise OSError("cable")

    def set_gripper(self, close: bool) -> None:
        pass

    def close(self) -> None:
        pass

    def step(self, time: float, target: np.ndarray | None) -> ArmReading:
        self.targets.append(target)
        if isinstance(self.reading, Exception):
            raise self.reading
        return self.reading  # pyright: ignore[reportReturnType]


class World:
    """Driver and its clock."""

    def __init__(self, kinematics: UrdfKinematics, arm: object | None = None) -> None:
        joints = kinematics.solve_anywhere(START)
        assert joints is not None
        self.start, self.now = joints, 1_000_000_000
        self.arm = Scripted(joints)
        name = Extension("ends.right.driver", "mine:Arm", DRIVERS)
        self.driver = JointArmDriver(
            "mine:Arm", self.arm if arm is None else arm, name, kinematics, Limits()
        )

    def step(self, target: Pose | None = None) -> ArmFeedback:
        self.now += TICK
        return self.driver.step(self.now, target, STILL)


def test_the_arm_of_the_guide_follows_a_line_with_its_lag_alone(
    kinematics: UrdfKinematics, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    write_examples(tmp_path)
    monkeypatch.syspath_prepend(str(tmp_path))
    joints = kinematics.solve_anywhere(START)
    assert joints is not None
    name = Extension("ends.right.driver", "lagging_arm:LaggingArm", DRIVERS)
    setup = ArmSetup("right", "", UR5.path, UR5.flange, joints, 1.6)
    world = World(kinematics, name.create(("step",), setup))
    world.driver.enable()
    for _ in range(5):
        world.step()
    speed = np.array([0.0, 0.1, 0.0])
    target, feedback = START, world.step()
    for k in range(150):
        target = Pose(START.position + k * 0.008 * speed, START.orientation)
        feedback = world.step(target)
    assert feedback.pose is not None
    behind = target.position - feedback.pose.position
    # A first-order lag of 50 ms at 0.1 m/s; one tick more or less in discrete time.
    assert 0.004 < behind[1] < 0.006
    assert np.max(np.abs(behind[[0, 2]])) < 5e-4
    np.testing.assert_allclose(feedback.velocity[0], speed, atol=3e-3)


def test_a_target_far_from_the_arm_is_not_sent(kinematics: UrdfKinematics):
    world = World(kinematics)
    world.driver.enable()
    world.step()
    world.step(Pose(START.position + np.array([0.0, 0.0, 0.02]), START.orientation))
    assert world.arm.targets[-1] is None
    world.step(Pose(START.position + np.array([0.0, 0.0, 0.002]), START.orientation))
    assert world.arm.targets[-1] is not None


@pytest.mark.parametrize(
    ("reading", "fault", "words"),
    [
        (ZeroDivisionError("gain"), "alarm", "step() raised ZeroDivisionError: gain"),
        (ArmReading(np.full(6, np.nan), ready=True), "alarm", "not finite"),
        (ArmReading(np.zeros(7), ready=True), "alarm", "shape (7,), not (6,)"),
        (None, "alarm", "step() raised AttributeError"),
        (ArmReading(np.zeros(6), faults=("overload of joint 2",)), "alarm", "overload of joint 2"),
        (ArmReading(np.zeros(6), connected=False), "lost_link", "the arm does not answer"),
    ],
)
def test_a_faulty_reading_stops_the_arm_and_is_named(
    kinematics: UrdfKinematics, reading: object, fault: str, words: str
):
    world = World(kinematics)
    world.driver.enable()
    world.step()
    assert world.step(START).ready
    world.arm.reading = reading
    feedback = world.step(START)
    assert not feedback.ready
    assert feedback.fault == fault
    assert any(words in alarm for alarm in feedback.alarms), feedback.alarms
    # What it last knew is not forgotten: the gateway stops from there.
    assert feedback.pose is not None
    world.step(START)
    assert world.arm.targets[-1] is None


def test_an_acknowledged_arm_is_enabled_again(kinematics: UrdfKinematics):
    world = World(kinematics)
    world.driver.enable()
    world.arm.reading = RuntimeError("once")
    assert world.step().fault == "alarm"
    world.arm.reading = ArmReading(world.start, ready=True)
    world.driver.recover()
    feedback = world.step()
    assert feedback.fault == ""
    assert feedback.ready


def test_a_method_that_raises_is_a_fault_too(kinematics: UrdfKinematics):
    world = World(kinematics)
    world.driver.enable()
    world.step()
    world.driver.disable()
    alarms = world.step().alarms
    assert any("disable() raised OSError: cable" in alarm for alarm in alarms)


def test_the_change_of_the_force_since_arming_counts(kinematics: UrdfKinematics):
    world = World(kinematics)
    weight = np.array([0.0, 0.0, -6.0])
    world.arm.reading = ArmReading(world.start, ready=True, force=weight)
    world.driver.enable()
    assert world.step().contact_force == 0.0
    pulled = weight + np.array([3.0, 0.0, 4.0])
    world.arm.reading = ArmReading(world.start, ready=True, force=pulled)
    feedback = world.step()
    assert feedback.contact_force == pytest.approx(5.0)
    assert feedback.wrench is not None
    np.testing.assert_allclose(feedback.wrench, [pulled, [np.nan] * 3])
    assert World(kinematics).step().wrench is None

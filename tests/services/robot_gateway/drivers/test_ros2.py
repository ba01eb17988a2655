"""Arm behind a ROS 2 trajectory controller: it follows, and its silence is a lost link."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest

from lariat.arms.kinematics import UrdfKinematics
from lariat.arms.urdf import Urdf
from lariat.configuration import ConfigurationError
from lariat.geometry.poses import Pose
from lariat.protocols import ArmSetup
from lariat.scenario.extensions import Extension
from lariat.scenario.sections import DRIVERS, Limits
from services.robot_gateway.drivers.joint_arm import JointArmDriver
from services.robot_gateway.drivers.ros2 import POINT_PERIOD, Ros2Arm
from shared.ros2.types import ros
from shared.runtime.free_port import free_port
from tests.robots import UR5
from tests.services.robot_gateway.drivers.trajectory_controller import (
    CONTROLLER,
    TrajectoryController,
)
from tests.shared.cell import until

pytestmark = pytest.mark.live

HERE = Pose(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]))
TOOL = Pose(np.array([0.0, 0.0, 0.12]), np.array([1.0, 0.0, 0.0, 0.0]))
START = Pose(np.array([0.4, 0.1, 0.3]), np.array([0.0, 1.0, 0.0, 0.0]))


class Bench:
    """Driver of an arm and its controller."""

    def __init__(self, action: bool = False) -> None:
        self.router = f"tcp/127.0.0.1:{free_port()}"
        self.kinematics = UrdfKinematics(UR5.path, UR5.flange, HERE, TOOL)
        start = self.kinematics.solve_anywhere(START)
        assert start is not None
        names = [joint.name for joint in Urdf(UR5.path).chain(UR5.flange)]
        self.controller = TrajectoryController(self.router, names, start, action)
        setup = ArmSetup("right", f"{self.router}/{CONTROLLER}", UR5.path, UR5.flange, start, 1.0)
        self.arm = Ros2Arm(setup)
        named = Extension(
            "ends.right.driver", "services.robot_gateway.drivers.ros2:Ros2Arm", DRIVERS
        )
        self.driver = JointArmDriver("ros2", self.arm, named, self.kinematics, Limits())
        self.silent = False

    def step(self, target: Pose | None = None):
        if not self.silent:
            self.controller.step()
        time.sleep(0.004)
        return self.driver.step(time.monotonic_ns(), target, np.zeros((2, 3)))

    def enable(self) -> None:
        self.driver.enable()
        until(lambda: self.step().ready)

    def close(self) -> None:
        self.driver.close()
        self.controller.node.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


def test_angles_are_those_of_the_joints_by_name(bench: Bench):
    until(lambda: bench.step().pose is not None)
    pose = bench.step().pose
    assert pose is not None
    np.testing.assert_allclose(pose.position, START.position, atol=1e-6)


def test_it_moves_only_once_it_is_enabled(bench: Bench):
    until(lambda: bench.step().pose is not None)
    assert not bench.step(START).ready
    for _ in range(20):
        bench.step(START)
    assert bench.controller.points == 0


def test_it_follows_a_line_within_its_tracking_limit(bench: Bench):
    bench.enable()
    began, worst, position = time.monotonic(), 0.0, START.position
    while (t := time.monotonic() - began) < 2.0:
        position = START.position + np.array([0.0, 0.05 * min(t, 1.0), 0.0])
        feedback = bench.step(Pose(position, START.orientation))
        assert feedback.pose is not None
        assert not feedback.fault
        worst = max(worst, float(np.linalg.norm(feedback.pose.position - position)))
    assert worst < bench.driver.tracking_limit
    end = bench.step(Pose(position, START.orientation)).pose
    assert end is not None
    np.testing.assert_allclose(end.position, START.position + np.array([0.0, 0.05, 0.0]), atol=1e-3)


def test_points_come_no_faster_than_stated(bench: Bench):
    bench.enable()
    until(lambda: bench.step(START) and bench.controller.points)
    link, begun = bench.arm._link, time.monotonic()
    assert link is not None
    before = link.commands._sequence
    for _ in range(200):
        bench.step(START)
    sent, elapsed = link.commands._sequence - before, time.monotonic() - begun
    assert 3 < sent <= elapsed / POINT_PERIOD + 1


@pytest.fixture
def action() -> Iterator[Bench]:
    made = Bench(action=True)
    yield made
    made.close()


def test_it_follows_a_line_by_goals_where_the_controller_has_no_topic(action: Bench):
    action.enable()
    began, target = time.monotonic(), START
    while (t := time.monotonic() - began) < 3.0:
        position = START.position + np.array([0.0, 0.05 * min(t, 1.0), 0.0])
        target = Pose(position, START.orientation)
        action.step(target)

    def arrived() -> bool:
        feedback = action.step(target)
        place = feedback.pose.position if feedback.pose else START.position
        return not feedback.fault and bool(np.linalg.norm(place - target.position) < 1e-3)

    until(arrived)
    assert action.controller.points > 3


def test_a_goal_that_is_rejected_is_a_fault_until_a_person_enables_the_arm(action: Bench):
    action.enable()
    action.controller.rejects = True
    until(lambda: action.step(START).fault == "alarm")
    assert "rejects a goal" in " ".join(action.step(START).alarms)
    action.controller.rejects = False
    action.driver.recover()
    action.enable()
    until(lambda: action.step(START) and action.controller.points)
    assert not action.step(START).fault


def test_a_goal_that_the_controller_gives_up_is_a_fault(action: Bench):
    action.enable()
    until(lambda: action.step(START) and action.controller.points)
    action.controller.gives_up = "path tolerance violated"
    until(lambda: action.step(START).fault == "alarm")
    assert "path tolerance violated" in " ".join(action.step(START).alarms)


def test_it_is_in_the_domain_of_the_environment(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ROS_DOMAIN_ID", "7")
    elsewhere = Bench()
    try:
        until(lambda: elsewhere.step() and elsewhere.arm._link)
        for _ in range(50):
            assert elsewhere.step().pose is None
    finally:
        elsewhere.close()


def test_silence_is_a_lost_link(bench: Bench):
    bench.enable()
    bench.silent = True
    began = time.monotonic()
    until(lambda: bench.step(START).fault == "lost_link")
    assert time.monotonic() - began < 0.5


def test_what_ros2_control_has_not_read_is_not_known(bench: Bench):
    controller, state = bench.controller, bench.controller._state
    controller._state = lambda velocities: state(np.full(6, np.nan))
    bench.enable()
    unread = ros("sensor_msgs/msg/JointState", name=controller._names, position=np.full(6, np.nan))
    controller._state = lambda velocities: unread
    until(lambda: bench.step(START).fault == "lost_link")


def test_a_controller_that_is_gone_is_named(bench: Bench):
    bench.enable()
    bench.controller.unsubscribe()
    until(lambda: bench.step(START).fault == "lost_link")
    assert CONTROLLER in " ".join(bench.step(START).alarms)


def test_without_router_it_is_not_connected():
    setup = ArmSetup(
        "right", f"tcp/127.0.0.1:{free_port()}/c", UR5.path, UR5.flange, np.zeros(6), 1
    )
    arm = Ros2Arm(setup)
    assert not arm.step(0.0, None).connected
    arm.close()


@pytest.mark.parametrize("address", ["192.0.2.7", "tcp/host:7447", "host:7447/c", "/c"])
def test_an_address_without_router_or_controller_is_refused(address: str):
    setup = ArmSetup("right", address, UR5.path, UR5.flange, np.zeros(6), 1.0)
    with pytest.raises(ConfigurationError, match="address"):
        Ros2Arm(setup)

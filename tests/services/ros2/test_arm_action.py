"""Gateway as server of FollowJointTrajectory: a client of another node, the node, and a cell."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from lariat.scenario import Scenario
from lariat.scenario.settings import load_with
from services.robot_gateway.service import build as build_gateway
from services.ros2.arm_action import Code
from services.ros2.options import Ros2Options
from services.ros2.service import Ros2Service
from shared import topics
from shared.messages import ArmCommand, ArmStates, Obstacle, Scene
from shared.ros2.actions import ActionClient, ClientGoal, Status
from shared.ros2.node import Node
from shared.ros2.types import FOLLOW_TRAJECTORY, duration, header, ros
from shared.runtime.free_port import free_port
from shared.runtime.service import Mailbox, Publication, Received
from tests.robots import UR5
from tests.shared.cell import until

TICK = 8_000_000
SCENARIO = load_with("fixed-end", UR5.settings("right"))
TWO_ARMS = load_with("two-arms", (
    *UR5.settings("left"), *UR5.settings("right"), "ends.left.base_position=[-0.65, 0.0, 0.0]",
    "ends.left.base_orientation=[1.0, 0.0, 0.0, 0.0]",
    "ends.left.tool_orientation=[1.0, 0.0, 0.0, 0.0]",
))  # fmt: skip
JOINTS = (
    "shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint",
    "wrist_3_joint",
)  # fmt: skip
NAMES = [f"right/{name}" for name in JOINTS]
LIFT = np.array([0.0, -0.05, 0.05, 0.0, 0.0, 0.0])
"""Short motion that pulls the rope's end back [rad]."""
SWING = np.array([-0.3, 0.0, 0.0, 0.0, 0.0, 0.0])
"""Motion to the side [rad]."""
POINT = "trajectory_msgs/msg/JointTrajectoryPoint"


class Bench:
    """Cell with simulated UR5s and node, stepped by hand, and a client on the wire."""

    def __init__(self, scenario: Scenario = SCENARIO) -> None:
        router = f"tcp/127.0.0.1:{free_port()}"
        self.gateway = build_gateway(scenario, "gateway-0")
        self.service = Ros2Service(scenario, "ros2-1", Ros2Options(router, 0, commands=True))
        self.service.warm_up()
        self.node = Node("moveit", router=router)
        self.client = ActionClient(self.node, "/lariat/follow_joint_trajectory", FOLLOW_TRAJECTORY)
        self.mailboxes = Mailbox(self.gateway.reads), Mailbox(self.service.reads)
        self.now = 10**12
        self.sequence = 0
        self.mute = False
        """Whether the node is silent."""
        until(lambda: self.client.matched)
        self.until(self.free)
        self.home = self.joints

    def free(self) -> bool:
        """Whether a trajectory would be executed."""
        return not self.gateway.cell._obstruction

    def deliver(self, place: int, topic: topics.Topic, message: Any) -> None:
        self.sequence += 1
        self.mailboxes[place].deliver(topic.key, Received(message, "p", self.sequence, self.now))

    def step(self) -> None:
        """One step of the node, four of the gateway."""
        for _ in range(4):
            self.now += TICK
            ((_, self.state),) = self.gateway.step(self.mailboxes[0].take(), self.now)
            self.deliver(1, topics.ARM_STATE, self.state)
        if not self.mute:
            sent: list[Publication] = list(self.service.step(self.mailboxes[1].take(), self.now))
            for publication in sent:
                self.deliver(0, publication.topic, publication.message)

    def until(self, condition: Any) -> None:
        deadline = time.monotonic() + 60.0
        while not condition():
            assert time.monotonic() < deadline, self.state
            self.step()
            # The wire has its own time.
            time.sleep(0.002)

    @property
    def joints(self) -> np.ndarray:
        return np.array(self.state.arms[1].joints)

    def send(self, *ways: np.ndarray, seconds: float = 1.0, **changes: Any) -> ClientGoal:
        """Goal whose points are these angles from the present ones, evenly spaced."""
        start = self.joints
        points = [
            ros(
                POINT,
                positions=start + way,
                time_from_start=duration(int(1e9 * seconds * (k + 1) / len(ways))),
            )
            for k, way in enumerate(ways)
        ]
        return self.client.send(goal(points, **changes))

    def ended(self, sent: ClientGoal) -> ClientGoal:
        self.until(lambda: sent.poll() or sent.status)
        return sent

    def executing(self, sent: ClientGoal) -> None:
        self.until(lambda: sent.poll() or self.state.trajectory_state == ArmStates.EXECUTING)

    def close(self) -> None:
        self.node.close()
        self.service.close()
        self.gateway.cell.close()


def goal(points: list[Any], names: list[str] | None = None, stamp: int = 0, **fields: Any) -> Any:
    trajectory = ros(
        "trajectory_msgs/msg/JointTrajectory",
        header=header(stamp, ""),
        joint_names=NAMES if names is None else names,
        points=points,
    )
    return ros(f"{FOLLOW_TRAJECTORY}_Goal", trajectory=trajectory, **fields)


def tolerance(name: str, position: float = 0.0, velocity: float = 0.0) -> Any:
    return ros(
        "control_msgs/msg/JointTolerance",
        name=name,
        position=position,
        velocity=velocity,
        acceleration=0.0,
    )


@pytest.fixture(scope="module")
def shared() -> Iterator[Bench]:
    made = Bench()
    yield made
    made.close()


@pytest.fixture
def bench(shared: Bench) -> Bench:
    """The bench, whose arm may move and stands at its start."""
    shared.mute = False
    shared.until(shared.free)
    away = shared.home - shared.joints
    if np.abs(away).max() > 1e-3:
        assert shared.ended(shared.send(away, seconds=2.0)).status is Status.SUCCEEDED
        shared.until(shared.free)
    return shared


def test_a_trajectory_is_executed_with_feedback_and_reached(bench: Bench) -> None:
    start = bench.joints
    tolerances = [tolerance(name, 0.002) for name in NAMES]
    sent = bench.ended(bench.send(0.5 * LIFT, LIFT, goal_tolerance=tolerances))
    assert (sent.status, sent.result.error_string) == (Status.SUCCEEDED, "")
    np.testing.assert_allclose(bench.joints, start + LIFT, atol=2e-3)
    feedback = sent.feedback[0]
    assert list(feedback.joint_names) == NAMES
    np.testing.assert_allclose(
        feedback.error.positions, feedback.desired.positions - feedback.actual.positions
    )


def test_joints_in_another_order_are_taken_by_their_names(bench: Bench) -> None:
    start = bench.joints
    names = NAMES[::-1]
    point = ros(
        POINT,
        positions=(start + LIFT)[::-1].copy(),
        velocities=np.zeros(6),
        time_from_start=duration(10**9),
    )
    sent = bench.ended(bench.client.send(goal([point], names)))
    assert sent.status is Status.SUCCEEDED, sent.result
    bench.until(lambda: np.abs(bench.joints - start - LIFT).max() < 2e-3)


@pytest.mark.parametrize(
    ("ways", "changes", "code", "word"),
    [
        ([LIFT], {"names": ["a", *NAMES[1:]]}, Code.INVALID_JOINTS, "name all joints"),
        ([LIFT], {"names": []}, Code.INVALID_JOINTS, "name all joints"),
        ([], {}, Code.INVALID_GOAL, "0 points"),
        ([LIFT, LIFT], {"seconds": 0.0}, Code.INVALID_GOAL, "does not increase"),
        ([LIFT[:3]], {"seconds": 1.0}, Code.INVALID_GOAL, "one position for each"),
        ([np.nan * LIFT], {}, Code.INVALID_GOAL, "not finite"),
        ([LIFT], {"stamp": 1}, Code.OLD_HEADER_TIMESTAMP, "stamp"),
        ([LIFT], {"stamp": 2 * 10**12}, Code.INVALID_GOAL, "stamp"),
        ([LIFT], {"path_tolerance": [tolerance("x", 1.0)]}, Code.INVALID_JOINTS, "'x'"),
        ([LIFT], {"path_tolerance": [tolerance(NAMES[0], 1.0, 1.0)]}, Code.INVALID_GOAL, "veloc"),
        # Rules of the gateway.
        ([10.0 * LIFT], {"seconds": 0.3}, Code.INVALID_GOAL, "speed"),
        ([np.array([0.0, 1.2, 0.0, 0.0, 0.0, 0.0])], {"seconds": 8.0}, Code.INVALID_GOAL, ""),
        ([LIFT], {"seconds": 61.0}, Code.INVALID_GOAL, "60"),
    ],
    ids=["joint", "no joint", "no point", "times", "widths", "nan", "old", "future", "tolerance",
         "velocity", "speed", "table or rope", "long"],
)  # fmt: skip
def test_a_goal_that_breaks_a_rule_moves_nothing(
    bench: Bench, ways: list, changes: dict, code: Code, word: str
) -> None:
    start = bench.gateway.cell.follower.state.positions.copy()
    if ways and len(ways[0]) == 3:
        ways = [np.zeros(6)]
        changes = {**changes, "names": NAMES}
        point = ros(
            POINT,
            positions=np.zeros(3),
            time_from_start=duration(10**9),
        )
        sent = bench.client.send(goal([point]))
    else:
        sent = bench.send(*ways, **changes)
    bench.ended(sent)
    assert (sent.status, sent.result.error_code) == (Status.ABORTED, code), sent.result
    assert word in sent.result.error_string
    np.testing.assert_array_equal(bench.gateway.cell.follower.state.positions, start)


def test_a_goal_of_both_arms_moves_them_together() -> None:
    bench = Bench(TWO_ARMS)
    try:
        start = np.array([arm.joints for arm in bench.state.arms])
        # Grips that go the same way: the arms face each other.
        way = np.outer([1.0, -1.0], 0.5 * SWING)
        names = [f"{side}/{name}" for name in JOINTS for side in ("right", "left")]
        point = ros(
            POINT,
            positions=(start + way)[::-1].T.ravel().copy(),
            time_from_start=duration(2 * 10**9),
        )
        sent = bench.client.send(goal([point], names))
        shares = []

        def ended() -> bool:
            sent.poll()
            if all(arm.commanded_joints for arm in bench.state.arms):
                moved = np.array([arm.commanded_joints for arm in bench.state.arms]) - start
                shares.append(moved[:, 0] / way[:, 0])
            return sent.status is not None

        bench.until(ended)
        assert sent.status is Status.SUCCEEDED, sent.result
        bench.until(lambda: np.abs([a.joints for a in bench.state.arms] - start - way).max() < 2e-3)
        assert any(0.3 < left < 0.7 for left, _ in shares)
        assert np.ptp(shares, axis=1).max() < 1e-6
    finally:
        bench.close()


def test_a_cancel_stops_on_the_way(bench: Bench) -> None:
    start = bench.joints
    sent = bench.send(SWING, seconds=4.0)
    bench.until(lambda: sent.poll() or np.abs(bench.joints - start).max() > 0.02)
    sent.cancel()
    assert bench.ended(sent).status is Status.CANCELED
    bench.until(lambda: bench.gateway.cell.follower.resting)
    assert np.abs(bench.joints - start).max() < 0.15
    assert bench.state.may_move


def test_another_goal_meanwhile_is_refused(bench: Bench) -> None:
    first = bench.send(LIFT, seconds=2.0)
    bench.executing(first)
    second = bench.ended(bench.send(LIFT))
    assert (second.status, second.result.error_code) == (Status.ABORTED, Code.INVALID_GOAL)
    assert bench.ended(first).status is Status.SUCCEEDED


def test_a_violated_tolerance_of_the_path_aborts(bench: Bench) -> None:
    sent = bench.send(LIFT, path_tolerance=[tolerance(name, 1e-6) for name in NAMES])
    bench.ended(sent)
    assert (sent.status, sent.result.error_code) == (Status.ABORTED, Code.PATH_TOLERANCE_VIOLATED)
    assert "rad off" in sent.result.error_string


def test_an_obstacle_that_appears_on_the_way_stops_it(bench: Bench) -> None:
    sent = bench.send(SWING, seconds=4.0)
    bench.executing(sent)
    ahead = bench.gateway.cell.follower.state.positions[0] + np.array([-0.02, 0.12, 0.0])
    box = Obstacle(name="box", shape="box", position=ahead, size=[0.04, 0.04, 0.04])
    bench.deliver(0, topics.SCENE_STATE, Scene(revision=1, obstacles=[box]))
    bench.ended(sent)
    assert sent.status is Status.ABORTED
    assert bench.gateway.cell.follower.state.positions[0, 1] < ahead[1]
    bench.deliver(0, topics.SCENE_STATE, Scene(revision=2))


def test_a_silent_node_stops_the_arm(bench: Bench) -> None:
    sent = bench.send(LIFT, seconds=4.0)
    bench.executing(sent)
    bench.mute = True
    bench.until(lambda: bench.state.trajectory_state == ArmStates.STOPPED)
    assert "silent" in bench.state.trajectory_reason
    bench.mute = False
    assert bench.ended(sent).status is Status.ABORTED


def test_a_hold_of_a_person_stops_it_and_the_next_goal_is_refused(bench: Bench) -> None:
    sent = bench.send(LIFT, seconds=4.0)
    bench.executing(sent)
    hold = ArmCommand(id="h", action=ArmCommand.HOLD)
    bench.deliver(0, topics.ARM_HOLD, hold)
    assert bench.ended(sent).status is Status.ABORTED
    assert "held" in sent.result.error_string
    refused = bench.ended(bench.send(LIFT))
    assert "may not move" in refused.result.error_string

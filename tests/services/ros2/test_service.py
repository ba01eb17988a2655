"""ROS 2 node of a cell: what another node sees of it, and what it may do."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.RawImage_pb2 import RawImage

from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, load
from lariat.scenario.sections import Ros2, Ros2Topic
from lariat.scenario.settings import load_with
from services.ros2.options import Ros2Options
from services.ros2.service import Ros2Service
from shared import topics
from shared.messages import (
    FAILED,
    IDLE,
    REACHED,
    RUNNING,
    ArmCommand,
    ArmState,
    ArmStates,
    NodeChain,
    Obstacle,
    RunResult,
    Scene,
    SceneRequest,
    TaskRequest,
    TaskState,
    timestamp,
)
from shared.ros2.actions import ActionClient, Status
from shared.ros2.node import Node
from shared.ros2.outputs import outputs
from shared.ros2.types import SHAPE_ROPE, header, nanoseconds, ros, vector
from shared.ros2.wire import LATCHED, Qos
from shared.runtime.free_port import free_port
from shared.runtime.service import Mailbox, Publication, Received
from shared.topics import Topic
from stack.credentials.access_control import published_keys
from tests.shared.cell import until

PERIOD = 33_333_333
TRIGGER = "std_srvs/srv/Trigger"


class Bench:
    """Service that is stepped by hand, and another node of its graph."""

    def __init__(self, scenario: Scenario, commands: bool = True) -> None:
        router = f"tcp/127.0.0.1:{free_port()}"
        self.service = Ros2Service(scenario, "ros2-1", Ros2Options(router, 0, commands=commands))
        self.service.warm_up()
        self.node = Node("other", router=router)
        self.mailbox = Mailbox(self.service.reads)
        self.sent: list[Publication] = []
        self.now = 10**9
        self._sequence = 0

    def deliver(self, topic: Topic, message: Any) -> None:
        self._sequence += 1
        self.mailbox.deliver(topic.key, Received(message, "p-1", self._sequence, self.now))

    def step(self) -> None:
        self.now += PERIOD
        self.sent += list(self.service.step(self.mailbox.take(), self.now))

    def requests(self, kind: type) -> list[Any]:
        return [p.message for p in self.sent if isinstance(p.message, kind)]

    def until(self, condition) -> None:
        until(lambda: self.step() or condition())

    def answer_task(self, request: TaskRequest, state: int = IDLE, refusal: str = "") -> None:
        self.deliver(
            topics.TASK_STATE, TaskState(state=state, last_request=request.id, refusal=refusal)
        )

    def close(self) -> None:
        self.node.close()
        self.service.close()


@pytest.fixture
def bench() -> Iterator[Bench]:
    with ExitStack() as stack:
        made = Bench(load("three-cylinders"))
        stack.callback(made.close)
        yield made


def pose(place: tuple[float, float, float]) -> Any:
    turn = ros("geometry_msgs/msg/Quaternion", w=1.0)
    return ros("geometry_msgs/msg/Pose", position=vector(place), orientation=turn)


def goal(*places: tuple[float, float, float], frame: str = "world") -> Any:
    poses = [pose(place) for place in places]
    return ros("geometry_msgs/msg/PoseArray", header=header(0, frame), poses=poses)


def call(bench: Bench, name: str) -> Any:
    client = bench.node.client(f"/lariat/{name}", TRIGGER)
    until(lambda: client.matched)
    return client.call(ros(f"{TRIGGER}_Request"), 20.0)


def test_the_rope_is_a_cloud_with_arc_length_and_sigma(bench: Bench):
    cloud = bench.node.subscription("/lariat/rope/points", "sensor_msgs/msg/PointCloud2")
    got: list[Any] = []

    def arrived() -> bool:
        chain = NodeChain(stamp=5, positions=[0, 0, 0, 0.1, 0, 0, 0.1, 0.2, 0], sigma=[1, 2, 3])
        bench.deliver(topics.ROPE_NODES, chain)
        bench.step()
        got.extend(cloud.take())
        return bool(got)

    until(arrived)
    names = [f.name for f in got[0].fields]
    rows = np.frombuffer(got[0].data.tobytes(), "<f4").reshape(-1, 5)
    assert names == ["x", "y", "z", "s", "sigma"]
    np.testing.assert_allclose(rows[2], [0.1, 0.2, 0.0, 0.3, 3.0], rtol=1e-6)
    assert (got[0].header.frame_id, got[0].header.stamp.nanosec) == ("world", 5)


@pytest.mark.parametrize("source", ["truth", "camera"])
def test_the_clock_is_that_of_the_simulated_plant(source: str):
    bench = Bench(load_with("three-cylinders", {"sensing.source": source}))
    heard = bench.node.subscription("/clock", "rosgraph_msgs/msg/Clock", Qos(depth=100))
    stamps: list[int] = []
    got: list[Any] = []

    def arrived() -> bool:
        stamps.append(len(stamps) * 10**9 + 7)
        if source == "truth":
            bench.deliver(topics.ROPE_TRUTH, NodeChain(stamp=stamps[-1]))
        else:
            at = timestamp(stamps[-1])
            bench.deliver(topics.CAMERA_COLOR.at("overhead"), CompressedImage(timestamp=at))
            bench.deliver(topics.CAMERA_DEPTH.at("overhead"), RawImage(timestamp=at))
        bench.step()
        got.extend(heard.take())
        return bool(got)

    try:
        until(arrived)
        assert nanoseconds(got[0].clock) in stamps
        reads = {topic.key for topic in bench.service.reads}
        assert (topics.ROPE_TRUTH.key in reads) == (source == "truth")
    finally:
        bench.close()


def test_poses_of_the_rope_have_z_along_it(bench: Bench):
    heard = bench.node.subscription("/lariat/rope/poses", "geometry_msgs/msg/PoseArray")
    got: list[Any] = []

    def arrived() -> bool:
        bench.deliver(topics.ROPE_NODES, NodeChain(positions=[0, 0, 0, 1, 0, 0, 2, 0, 0]))
        bench.step()
        got.extend(heard.take())
        return bool(got)

    until(arrived)
    q = got[0].poses[1].orientation
    # z turned to x: a quarter turn about y.
    np.testing.assert_allclose((q.w, q.x, q.y, q.z), (0.5**0.5, 0, 0.5**0.5, 0), atol=1e-12)


def test_frames_and_joints_follow_the_arms_without_a_recorder(bench: Bench):
    frames = bench.node.subscription("/tf", "tf2_msgs/msg/TFMessage")
    got: list[Any] = []

    def arrived() -> bool:
        arm = ArmState(arm="right", position=[0.3, 0.2, 0.1], orientation=[1, 0, 0, 0])
        bench.deliver(topics.ARM_STATE, ArmStates(arms=[arm]))
        bench.step()
        got.extend(frames.take())
        return bool(got)

    until(arrived)
    grip = next(t for t in got[0].transforms if t.child_frame_id == "right/grip")
    assert (grip.header.frame_id, grip.transform.translation.x) == ("world", 0.3)


def test_names_frames_and_rates_are_those_of_the_scenario():
    topics_ = {"rope/poses": Ros2Topic("/rope", rate=5.0), "goal": Ros2Topic("/goal_pose")}
    settings = Ros2("/cell", "map", "lariat/", topics_)
    bench = Bench(replace(load("three-cylinders"), ros2=settings))
    try:
        rope = bench.node.subscription("/rope", "geometry_msgs/msg/PoseArray", Qos(depth=100))
        frames = bench.node.subscription("/tf", "tf2_msgs/msg/TFMessage", Qos(depth=100))
        got: list[Any] = []
        moved: list[Any] = []
        arms = ArmStates(arms=[ArmState(arm="right", position=[0, 0, 0], orientation=[1, 0, 0, 0])])

        def deliver() -> None:
            bench.deliver(topics.ARM_STATE, arms)
            bench.deliver(topics.ROPE_NODES, NodeChain(positions=[0, 0, 0, 1, 0, 0]))
            bench.step()
            got.extend(rope.take())
            moved.extend(frames.take())

        until(lambda: deliver() or (got and moved))
        transform = moved[0].transforms[0]
        assert transform.header.frame_id == "map"
        assert transform.child_frame_id.startswith("lariat/")
        assert got[0].header.frame_id == "map"
        got.clear()
        for _ in range(60):
            deliver()
        until(lambda: got.extend(rope.take()) or len(got) >= 9)
        # Two seconds of steps at 30 Hz.
        assert 9 <= len(got) <= 11
        publisher = bench.node.publisher("/goal_pose", "geometry_msgs/msg/PoseArray")
        until(lambda: publisher.matched)
        publisher.put(goal((0, 0, 0.1), (0.3, 0, 0.1), frame="map"))
        bench.until(lambda: bench.requests(TaskRequest))
    finally:
        bench.close()


def test_who_comes_late_gets_the_description_of_the_robot(bench: Bench):
    late = bench.node.subscription("/robot_description", "std_msgs/msg/String", LATCHED)
    got: list[Any] = []
    until(lambda: got.extend(late.take()) or got)
    assert got[0].data.count("<robot") == 1


def test_every_row_of_the_table_has_a_publisher_in_the_graph(bench: Bench):
    replies = bench.node._session.liveliness().get("@ros2_lv/**", timeout=5.0)
    tokens = [str(r.ok.key_expr).split("/") for r in replies if r.ok is not None]
    published = {part[9].replace("%", "/") for part in tokens if part[5] == "MP"}
    for output in outputs():
        name = output.name if output.name.startswith("/") else f"/lariat/{output.name}"
        names = {name.replace("{name}", value) for value in ("overhead", "rope")}
        assert names & published, name


def test_a_trigger_is_answered_with_the_answer_of_the_controller(bench: Bench):
    asked = call(bench, "start")
    bench.until(lambda: bench.requests(TaskRequest))
    (request,) = bench.requests(TaskRequest)
    assert request.action == TaskRequest.START
    bench.answer_task(request, refusal="the arms are disarmed")
    answers: list[Any] = []
    bench.until(lambda: answers.append(asked.take()) or answers[-1])
    assert (answers[-1].success, answers[-1].message) == (False, "the arms are disarmed")


def test_a_trigger_that_nobody_answers_fails(bench: Bench):
    asked = call(bench, "stop")
    bench.until(lambda: bench.requests(TaskRequest))
    bench.now += 4 * 10**9
    answers: list[Any] = []
    bench.until(lambda: answers.append(asked.take()) or answers[-1])
    assert answers[-1].success is False


def test_nothing_arms_or_resumes(bench: Bench):
    replies = bench.node._session.liveliness().get("@ros2_lv/**", timeout=5.0)
    tokens = [str(r.ok.key_expr).split("/") for r in replies if r.ok is not None]
    served = {part[9].rpartition("%")[2] for part in tokens if part[5] == "SS"}
    actions = {"send_goal", "cancel_goal", "get_result"}
    assert topics.ARM_COMMAND not in bench.service.writes
    assert served - actions == {"start", "pause", "stop", "reset", "hold"}
    mine = [key for key in published_keys("ros2") if key.startswith("arm/")]
    assert mine == [topics.ARM_HOLD.key, topics.ARM_TRAJECTORY.key]


def test_a_hold_is_answered_by_the_gateway(bench: Bench):
    asked = call(bench, "hold")
    bench.until(lambda: bench.requests(ArmCommand))
    (hold,) = bench.requests(ArmCommand)
    # A command that came right after it hides the answer: it is sent again.
    bench.deliver(topics.ARM_STATE, ArmStates(last_command=hold.id))
    bench.deliver(topics.ARM_STATE, ArmStates(last_command="of-a-person"))
    bench.step()
    assert asked.take() is None
    assert [each.id for each in bench.requests(ArmCommand)] == [hold.id, hold.id]
    bench.deliver(topics.ARM_STATE, ArmStates(last_command=hold.id))
    answers: list[Any] = []
    bench.until(lambda: answers.append(asked.take()) or answers[-1])
    assert (answers[-1].success, answers[-1].message) == (True, "")


def test_all_who_ask_for_a_hold_at_a_time_are_answered_by_one(bench: Bench):
    client = bench.node.client("/lariat/hold", TRIGGER)
    until(lambda: client.matched)
    asked = [client.call(ros(f"{TRIGGER}_Request"), 20.0) for _ in range(5)]
    time.sleep(0.5)
    bench.until(lambda: bench.requests(ArmCommand))
    (hold,) = bench.requests(ArmCommand)
    # A state names the newest command alone.
    bench.deliver(topics.ARM_STATE, ArmStates(last_command=hold.id))
    bench.until(lambda: all(each.replies for each in asked))
    assert len(bench.requests(ArmCommand)) == 1
    answers = [each.take() for each in asked]
    assert all(answer is not None and answer.success for answer in answers)


def test_without_permission_nothing_is_taken():
    bench = Bench(load("three-cylinders"), commands=False)
    try:
        replies = bench.node._session.liveliness().get("@ros2_lv/**", timeout=5.0)
        kinds = {str(r.ok.key_expr).split("/")[5] for r in replies if r.ok is not None}
        assert kinds == {"NN", "MP"}
        assert bench.service.writes == ()
    finally:
        bench.close()


@pytest.mark.parametrize(
    ("places", "positions"),
    [
        ([(0, 0, 0.1), (0.3, 0, 0.1)], []),
        ([(0, 0, 0), (1, 0, 0), (2, 0, 0)], [0, 0, 0, 1, 0, 0, 2, 0, 0]),
    ],
    ids=["grips", "nodes"],
)
def test_poses_become_a_goal(bench: Bench, places: list, positions: list):
    publisher = bench.node.publisher("/lariat/goal", "geometry_msgs/msg/PoseArray")
    until(lambda: publisher.matched)
    publisher.put(goal(*places))
    bench.until(lambda: bench.requests(TaskRequest))
    (request,) = bench.requests(TaskRequest)
    assert request.action == TaskRequest.SET_GOAL
    assert list(request.goal.positions) == positions
    assert list(request.goal.right.position) == list(places[-1])


@pytest.mark.parametrize(
    "message",
    [
        goal((0, 0, 0), (1, 0, 0), frame="camera"),
        goal((0, 0, 0)),
        goal((0, 0, np.nan), (1, 0, 0)),
        goal((0, 0, 0), (np.inf, 0, 0), (1, 0, 0)),
        goal((0, 0, 0), (1e300, 0, 0)),
    ],
    ids=["frame", "one pose", "not a number", "infinite", "far"],
)
def test_goals_that_the_controller_would_not_take_are_refused(bench: Bench, message: Any):
    publisher = bench.node.publisher("/lariat/goal", "geometry_msgs/msg/PoseArray")
    client = ActionClient(bench.node, "/lariat/shape_rope", SHAPE_ROPE)
    until(lambda: publisher.matched and client.matched)
    publisher.put(message)
    bench.until(lambda: bench.service.door.refused)
    sent = client.send(ros(f"{SHAPE_ROPE}_Goal", goal=message))
    bench.until(lambda: sent.poll() or sent.accepted is not None)
    assert sent.accepted is False
    assert not bench.requests(TaskRequest)


def solid(kind: int, *sizes: float) -> Any:
    empty = ros("geometry_msgs/msg/Polygon", points=[])
    values = np.array(sizes)
    return ros("shape_msgs/msg/SolidPrimitive", type=kind, dimensions=values, polygon=empty)


def collision_object(name: str, operation: int, *solids: Any) -> Any:
    origin = pose((0.1, 0.2, 0.3))
    return ros(
        "moveit_msgs/msg/CollisionObject",
        header=header(0, "world"),
        pose=origin,
        id=name,
        type=ros("object_recognition_msgs/msg/ObjectType", key="", db=""),
        primitives=list(solids),
        primitive_poses=[pose((0.0, 0.0, 0.1)) for _ in solids],
        operation=operation,
    )


def test_collision_objects_become_obstacles_that_move_and_go(bench: Bench):
    publisher = bench.node.publisher("/lariat/collision_object", "moveit_msgs/msg/CollisionObject")
    until(lambda: publisher.matched)
    publisher.put(collision_object("post", 0, solid(3, 0.4, 0.02)))
    bench.until(lambda: bench.requests(SceneRequest))
    (request,) = bench.requests(SceneRequest)
    obstacle = request.obstacle
    assert request.action == SceneRequest.ADD
    assert (obstacle.name, obstacle.shape) == ("post.0", "cylinder")
    assert (obstacle.radius, obstacle.height) == (0.02, 0.4)
    np.testing.assert_allclose(obstacle.position, [0.1, 0.2, 0.4])
    bench.deliver(topics.SCENE_STATE, Scene(obstacles=[Obstacle(name="post.0")]))
    publisher.put(collision_object("post", 1))
    bench.until(lambda: len(bench.requests(SceneRequest)) == 2)
    removal = bench.requests(SceneRequest)[1]
    assert (removal.action, removal.obstacle.name) == (SceneRequest.REMOVE, "post.0")


def shape(bench: Bench) -> tuple[ActionClient, Any]:
    client = ActionClient(bench.node, "/lariat/shape_rope", SHAPE_ROPE)
    until(lambda: client.matched)
    sent = client.send(ros(f"{SHAPE_ROPE}_Goal", goal=goal((0, 0, 0.1), (0.3, 0, 0.1))))
    for count in (1, 2):
        bench.until(lambda count=count: len(bench.requests(TaskRequest)) == count)
        bench.answer_task(bench.requests(TaskRequest)[-1], RUNNING if count == 2 else IDLE)
    bench.until(lambda: sent.poll() or sent.accepted)
    return client, sent


def test_the_action_sets_the_goal_starts_reports_and_succeeds(bench: Bench):
    _, sent = shape(bench)
    actions = [r.action for r in bench.requests(TaskRequest)]
    assert actions == [TaskRequest.SET_GOAL, TaskRequest.START]
    bench.deliver(topics.TASK_STATE, TaskState(state=RUNNING, error=0.25, clearance=0.1))
    bench.until(lambda: sent.poll() or (sent.feedback and sent.feedback[-1].error))
    assert sent.feedback[-1].error == 0.25
    bench.deliver(topics.RUN_RESULT, RunResult(min_clearance=0.03))
    bench.deliver(topics.TASK_STATE, TaskState(state=REACHED, error=0.001, reason="at rest"))
    bench.until(lambda: sent.poll() or sent.status)
    assert sent.status is Status.SUCCEEDED
    assert (sent.result.reached, sent.result.error) == (True, 0.001)
    assert (sent.result.min_clearance, sent.result.reason) == (0.03, "at rest")


def test_a_run_that_is_given_up_aborts_the_action(bench: Bench):
    _, sent = shape(bench)
    bench.deliver(topics.TASK_STATE, TaskState(state=FAILED, reason="no path"))
    bench.until(lambda: sent.poll() or sent.status)
    assert (sent.status, sent.result.reason) == (Status.ABORTED, "no path")


def test_a_cancel_stops_the_run(bench: Bench):
    _, sent = shape(bench)
    sent.cancel()
    bench.until(lambda: len(bench.requests(TaskRequest)) == 3)
    stop = bench.requests(TaskRequest)[-1]
    assert stop.action == TaskRequest.STOP
    bench.answer_task(stop)
    bench.until(lambda: sent.poll() or sent.status)
    assert sent.status is Status.CANCELED


def test_commands_go_with_ros2_alone():
    from cli.up.live_stack import run
    from cli.up.options import UpOptions

    with pytest.raises(ConfigurationError, match="--ros2"):
        run(UpOptions(port=free_port(), ros2_commands=True), None)

"""Node among hostile ones: whatever they send is refused and counted, and it goes on."""

from __future__ import annotations

import tracemalloc
from collections import deque
from collections.abc import Iterator
from contextlib import suppress
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from lariat.scenario.settings import load_with
from services.camera.ros2 import Ros2Camera
from services.ros2.options import Ros2Options
from services.ros2.service import Ros2Service
from shared import topics
from shared.messages import Scene, TaskRequest
from shared.ros2.node import MAX_STRUCTURED_SIZE, Node, Service, Subscription
from shared.ros2.types import (
    CDR_HEADER,
    FOLLOW_TRAJECTORY,
    SHAPE_ROPE,
    decoded,
    encoded,
    ros,
)
from shared.ros2.types import (
    time as stamp_of,
)
from shared.ros2.wire import Attachment
from shared.runtime.free_port import free_port
from shared.runtime.service import Mailbox, Received
from tests.robots import UR5
from tests.services.camera.test_ros2 import image, info
from tests.services.ros2.test_arm_action import NAMES, POINT
from tests.services.ros2.test_arm_action import goal as trajectory_goal
from tests.services.ros2.test_service import collision_object, goal, solid
from tests.shared.cell import until

PERIOD = 33_333_333
TRIGGER = "std_srvs/srv/Trigger"
ATTACHMENT = Attachment(1, 0, bytes(16)).encoded()
WORDS = st.one_of(
    st.integers(0, 3),
    st.sampled_from(
        [0xFFFFFFFF, 0x7FFFFFFF, 0x80000000, 0x7F800000, 0x7FF00000, 0x7FF80000, 10**6]
    ),
    st.integers(0, 2**32 - 1),
)
"""Words of 32 bits: lengths, infinities, numbers that are none."""


def uuid(value: int) -> Any:
    return ros("unique_identifier_msgs/msg/UUID", uuid=np.full(16, value, np.uint8))


def well_formed() -> dict[str, bytes]:
    """A message of every type that the node takes."""
    point = ros(
        POINT,
        positions=np.zeros(6),
        velocities=np.zeros(6),
        time_from_start=ros("builtin_interfaces/msg/Duration", sec=1, nanosec=0),
    )
    follow = trajectory_goal([point, point], NAMES)
    poses = goal((0, 0, 0.1), (0.3, 0, 0.1), (0.4, 0, 0.1))
    rope = ros(f"{SHAPE_ROPE}_Goal", goal=poses)
    messages = [poses, collision_object("a\nb\0", 0, solid(1, 0.1, 0.1, 0.1), solid(3, 0.4, 0.02))]
    messages.append(ros(f"{TRIGGER}_Request"))
    cancel = ros("action_msgs/msg/GoalInfo", goal_id=uuid(1), stamp=stamp_of(0))
    messages.append(ros("action_msgs/srv/CancelGoal_Request", goal_info=cancel))
    for kind, content in ((SHAPE_ROPE, rope), (FOLLOW_TRAJECTORY, follow)):
        messages.append(ros(f"{kind}_SendGoal_Request", goal_id=uuid(1), goal=content))
        messages.append(ros(f"{kind}_GetResult_Request", goal_id=uuid(1)))
    return {message.__msgtype__: bytes(encoded(message)) for message in messages}


VALID = well_formed()


def mutated(payload: bytes, changes: list[tuple[int, int]], cut: int) -> bytes:
    """The payload with some words replaced and its end cut."""
    body = bytearray(payload[4:])
    body += bytes(-len(body) % 4)
    for place, word in changes:
        if body:
            k = 4 * (place % (len(body) // 4))
            body[k : k + 4] = word.to_bytes(4, "little")
    return CDR_HEADER + bytes(body[: len(body) - cut] if cut else body)


MUTATIONS = st.builds(
    mutated,
    st.shared(st.sampled_from(sorted(VALID)), key="kind").map(VALID.__getitem__),
    st.lists(st.tuples(st.integers(0, 200), WORDS), max_size=4),
    st.integers(0, 40),
)
KIND = st.shared(st.sampled_from(sorted(VALID)), key="kind")
ATTACHMENTS = st.one_of(st.just(ATTACHMENT), st.just(None), st.binary(max_size=40))


class Bytes:
    """Bytes as Zenoh hands them over."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def to_bytes(self) -> bytes:
        return self._content

    def __len__(self) -> int:
        return len(self._content)


class Ring(deque):
    """What strangers have sent to one subscription or service."""

    def try_recv(self) -> Any:
        return self.popleft() if self else None


class Query(SimpleNamespace):
    """Request of a stranger."""

    answers = 0

    def reply(self, *_: Any, **__: Any) -> None:
        Query.answers += 1

    def reply_err(self, *_: Any) -> None:
        Query.answers += 1

    def drop(self) -> None:
        pass


class Bench:
    """Node whose inputs are filled without a wire."""

    def __init__(self) -> None:
        scenario = load_with("fixed-end", UR5.settings("right"))
        self.router = f"tcp/127.0.0.1:{free_port()}"
        self.service = Ros2Service(scenario, "ros2-1", Ros2Options(self.router, 0, commands=True))
        self.service.warm_up()
        self.door = self.service.door
        self.mailbox = Mailbox(self.service.reads)
        self.now = 10**12
        rope, commands, arm = cast("list[Any]", self.service._takers)
        self.takers: list[Subscription | Service] = [
            *commands._services.values(), commands._hold, commands._goals, commands._objects,
        ]  # fmt: skip
        for server in (rope._server, arm._server):
            self.takers += [server._send, server._cancel, server._results]

    def fill(self) -> dict[str, list[Ring]]:
        """Rings in place of the wire, by the type that they take."""
        rings: dict[str, list[Ring]] = {}
        for taker in self.takers:
            ring: Any = Ring()
            kind = taker.entity.type
            if isinstance(taker, Service):
                taker._queryable, kind = ring, f"{kind}_Request"
            else:
                taker._subscriber = ring
            rings.setdefault(kind, []).append(ring)
        return rings

    def step(self) -> list[Any]:
        self.now += PERIOD
        return list(self.service.step(self.mailbox.take(), self.now))


@pytest.fixture(scope="module")
def shared() -> Iterator[Bench]:
    made = Bench()
    # What is no fault of a sender is raised.
    made.door.strict = True
    made.mailbox.deliver(topics.SCENE_STATE.key, Received(Scene(), "p", 1, made.now))
    yield made
    made.service.close()


@given(kind=KIND, payload=st.one_of(MUTATIONS, st.binary(max_size=200)), attachment=ATTACHMENTS)
@settings(max_examples=300, deadline=None, suppress_health_check=list(HealthCheck))
def test_no_content_ends_the_node(
    shared: Bench, kind: str, payload: bytes, attachment: bytes | None
) -> None:
    before, answers = shared.door.refused, Query.answers
    sample = Query(
        payload=Bytes(payload), attachment=None if attachment is None else Bytes(attachment)
    )
    rings = shared.fill()
    for ring in rings[kind]:
        ring.append(sample)
    shared.step()
    assert not any(ring for group in rings.values() for ring in group)
    if attachment != ATTACHMENT:
        # Requests of before that nobody has answered are refused as well.
        assert shared.door.refused >= before + len(rings[kind])
        assert Query.answers >= answers + len(rings[kind]) * kind.endswith("_Request")


@pytest.mark.parametrize("kind", sorted(VALID))
def test_lengths_of_four_billion_take_no_memory(kind: str) -> None:
    payload = VALID[kind]
    tracemalloc.start()
    for k in range((len(payload) - 4) // 4):
        with suppress(ValueError):
            decoded(mutated(payload, [(k, 0xFFFFFFFF)], 0), kind)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**21


def test_a_flood_of_goals_leaves_the_node_bounded(shared: Bench) -> None:
    arm: Any = shared.service._takers[2]
    kind = f"{FOLLOW_TRAJECTORY}_SendGoal_Request"
    request = decoded(VALID[kind], kind)
    for k in range(2000):
        request.goal_id.uuid = np.frombuffer(k.to_bytes(16, "big"), np.uint8)
        rings = shared.fill()
        sample = Query(payload=Bytes(encoded(request)), attachment=Bytes(ATTACHMENT))
        rings[kind][0].append(sample)
        shared.step()
    assert len(arm._server._goals) <= 65
    unknown = f"{FOLLOW_TRAJECTORY}_GetResult_Request"
    rings, answers = shared.fill(), Query.answers
    for _ in range(32):
        sample = Query(payload=Bytes(VALID[unknown]), attachment=Bytes(ATTACHMENT))
        rings[unknown][0].append(sample)
    shared.step()
    assert Query.answers == answers + 32


def test_a_huge_message_is_refused_unread(shared: Bench) -> None:
    before, rings = shared.door.refused, shared.fill()
    poses = encoded(goal(*[(0.0, 0.0, 0.1)] * 5000))
    assert len(poses) > MAX_STRUCTURED_SIZE
    rings["geometry_msgs/msg/PoseArray"][0].append(
        Query(payload=Bytes(poses), attachment=Bytes(ATTACHMENT))
    )
    assert not any(isinstance(p.message, TaskRequest) for p in shared.step())
    assert shared.door.refused == before + 1


@given(
    changes=st.lists(st.tuples(st.integers(0, 60), WORDS), max_size=4),
    cut=st.integers(0, 40),
    which=st.sampled_from(["color", "depth", "info"]),
)
@settings(max_examples=150, deadline=None, suppress_health_check=list(HealthCheck))
def test_no_image_ends_the_camera(
    camera: Ros2Camera, changes: list[tuple[int, int]], cut: int, which: str
) -> None:
    colors = image(5, "bgr8", np.zeros((6, 8, 3), np.uint8))
    depths = image(5, "16UC1", np.zeros((6, 8), np.uint16))
    for name, message in (("color", colors), ("depth", depths), ("info", info())):
        payload = encoded(message)
        payload = mutated(payload, changes, cut) if name == which else payload
        ring: Any = Ring([SimpleNamespace(payload=Bytes(payload), attachment=Bytes(ATTACHMENT))])
        getattr(camera, f"_{name}")._subscriber = ring
    camera.newest(0)


@pytest.fixture(scope="module")
def camera() -> Iterator[Ros2Camera]:
    made = Ros2Camera("/c", "/d", "/i", f"tcp/127.0.0.1:{free_port()}", 0)
    made.door.strict = True
    yield made
    made.close()


def test_a_flood_on_the_wire_is_refused_and_a_call_is_answered() -> None:
    bench = Bench()
    stranger = Node("stranger", router=bench.router)
    try:
        publisher = stranger.publisher("/lariat/goal", "geometry_msgs/msg/PoseArray")
        action = "/lariat/follow_joint_trajectory/_action/send_goal"
        client = stranger.client(action, f"{FOLLOW_TRAJECTORY}_SendGoal")
        trigger = stranger.client("/lariat/stop", TRIGGER)
        until(lambda: publisher.matched and client.matched and trigger.matched)
        for k in range(300):
            raw = publisher._publisher
            raw.put(bytes(2**20 if k % 3 == 0 else k), attachment=ATTACHMENT)
            stranger._session.get(client.entity.key, lambda _: None, payload=bytes(k), timeout=5.0)
            # Tokens that are none of the convention.
            if k < 20:
                token = f"@ros2_lv/0/{'x' * (k + 1)}/{k}/NN/%/\u0001"
                stranger._kept.append(stranger._session.liveliness().declare_token(token))
        until(lambda: bench.step() or bench.door.refused > 20, 30.0)
        call, sent = trigger.call(ros(f"{TRIGGER}_Request"), 20.0), []
        until(lambda: sent.extend(bench.step()) or sent, 30.0)
        assert any(p.message.action == TaskRequest.STOP for p in sent)
        bench.now += 4 * 10**9
        answers: list[Any] = []
        until(lambda: bench.step() or answers.append(call.take()) or answers[-1], 30.0)
        assert answers[-1].success is False
    finally:
        stranger.close()
        bench.service.close()

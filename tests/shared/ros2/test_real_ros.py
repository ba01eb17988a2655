"""ROS 2 as others have it: rclpy's types and hashes, and another implementation of the wire."""

from __future__ import annotations

import json
import math
import subprocess
import threading
import time
from collections import deque
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cli.export.drawn_messages import drawn_messages
from shared.recording import Recording
from shared.ros2.actions import ActionServer, ServerGoal, Status
from shared.ros2.node import Call
from shared.ros2.outputs import outputs
from shared.ros2.table import Table
from shared.ros2.types import STORE, decoded, define_action, encoded, ros, type_hash
from shared.ros2.wire import LATCHED
from tests.cli.export.recorded import recording
from tests.shared.cell import until
from tests.shared.ros2.graph import Graph

ROOT = Path(__file__).parents[3]
RCLPY, PYZEROS = ROOT / ".ros" / "rclpy", ROOT / ".ros" / "pyzeros"
HERE = Path(__file__).parent
FIBONACCI = "test_msgs/action/Fibonacci"
WITHOUT_PACKAGE = {"tf2_msgs/msg/TFMessage"}
"""Published types for which there is no wheel of rclpy."""

pytestmark = pytest.mark.ros


def environment(path: Path) -> str:
    if not path.exists():
        pytest.skip("make ros makes the environment")
    return str(path / "bin" / "python")


def plain(value: Any) -> Any:
    """A message of ours as the peer prints its own."""
    if hasattr(value, "__msgtype__"):
        names = [name for name, _ in STORE.fielddefs[value.__msgtype__][1]]
        return {name: plain(getattr(value, name)) for name in names}
    if isinstance(value, str | bool | int | float):
        return value
    if isinstance(value, np.generic):
        return value.item()
    return [plain(each) for each in value]


def same(a: Any, b: Any) -> bool:
    if isinstance(a, dict):
        return a.keys() == b.keys() and all(same(a[k], b[k]) for k in a)
    if isinstance(a, list):
        return len(a) == len(b) and all(map(same, a, b))
    if isinstance(a, float) and isinstance(b, float) and math.isnan(a):
        return math.isnan(b)
    # ROS's `byte` is bytes of length one in Python.
    return a == b or ([a] == b)


def published(tmp_path: Path) -> dict[str, Any]:
    """A message of each type that a recording brings to ROS 2."""
    found = {}
    table = Table()
    for drawn in drawn_messages(Recording.open(recording(tmp_path, drawn=True))):
        for output in table.outputs:
            if output.source.matches(drawn.key):
                message = table.converted(output, drawn.message)
                found |= {} if message is None else {output.type: message}
    return found


def test_hashes_are_those_of_rclpys_packages():
    environment(RCLPY)
    compared = set()
    for file in (RCLPY / "share").glob("*/*/*.json"):
        for entry in json.loads(file.read_text()).get("type_hashes", []):
            name = entry["type_name"]
            if name in STORE.fielddefs and name.partition("/")[0] != "rmw_dds_common":
                if name == "std_msgs/msg/Char":
                    continue
                assert type_hash(name) == entry["hash_string"], name
                compared.add(name)
    wanted = {output.type for output in outputs()} - WITHOUT_PACKAGE
    assert wanted | {"std_srvs/srv/Trigger", "action_msgs/srv/CancelGoal"} <= compared


def test_rclpy_decodes_what_is_published_and_its_bytes_are_decoded(tmp_path: Path):
    python = environment(RCLPY)
    messages = list(published(tmp_path).items())
    # A message without fields is the one that rclpy makes without arguments.
    messages += [(kind, ros(kind)) for kind, _ in messages]
    lines = [f"{kind} {encoded(message).hex()}" for kind, message in messages]
    answer = subprocess.run(
        [python, str(HERE / "rclpy_peer.py")],
        input="\n".join(lines),
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
    )
    answers = [json.loads(line) for line in answer.stdout.splitlines()]
    known = 0
    for k, ((kind, message), found) in enumerate(zip(messages, answers, strict=True)):
        if kind in WITHOUT_PACKAGE:
            assert found is None
            continue
        values, payload, empty = found
        if k >= len(messages) // 2:
            assert same(values, empty), kind
        assert same(plain(decoded(encoded(message), kind)), values), kind
        assert same(plain(decoded(bytes.fromhex(payload), kind)), values), kind
        known += 1
    assert known == len(messages) - 2 * len(WITHOUT_PACKAGE)
    assert known >= 18


@pytest.mark.live
def test_another_implementation_sees_hears_and_calls_the_node():
    python = environment(PYZEROS)
    with ExitStack() as stack:
        graph = Graph(stack)
        node = graph.node("lariat", "/lariat")
        text = node.publisher("text", "std_msgs/msg/String")
        start = node.service("start", "std_srvs/srv/Trigger")
        heard = node.subscription("heard", "std_msgs/msg/String")
        peer = subprocess.Popen(
            [python, str(HERE / "pyzeros_peer.py"), graph.router],
            stdout=subprocess.PIPE,
            text=True,
            # Its codecs are compiled into the current folder at first use.
            cwd=PYZEROS,
        )
        stack.callback(peer.kill)
        got: list[str] = []
        deadline = time.monotonic() + 600.0
        while peer.poll() is None:
            assert time.monotonic() < deadline
            text.put(ros("std_msgs/msg/String", data="hällo"))
            for request in start.take():
                response = "std_srvs/srv/Trigger_Response"
                request.reply(ros(response, success=True, message="moved"))
            got += [m.data for m in heard.take()]
            time.sleep(0.1)
        assert peer.stdout is not None
        found = json.loads(peer.stdout.read())
    assert found["text"] == "hällo"
    assert found["answer"] == [True, "moved"]
    assert set(got) == {"hällo"}
    for entity in (text.entity, start.entity, heard.entity):
        assert entity.token in found["tokens"]
        assert found["gids"][entity.token] == entity.gid.hex()
    assert node.entity.token in found["tokens"]


@pytest.mark.live
def test_a_real_action_client_follows_one_goal_and_cancels_another():
    python = environment(RCLPY)
    define_action(FIBONACCI, "int32 order\n---\nint32[] sequence\n---\nint32[] sequence")
    with ExitStack() as stack:
        graph = Graph(stack)
        server = ActionServer(graph.first, "/fibonacci", FIBONACCI)
        relay = Relay(graph, python)
        stack.callback(relay.peer.kill)
        goal: ServerGoal | None = None
        sequence = [0, 1]
        deadline = time.monotonic() + 120.0
        while relay.found is None:
            assert time.monotonic() < deadline
            for new in server.take():
                new.accept()
                goal, sequence = new, [0, 1]
            if goal is not None and goal.active:
                sequence.append(sequence[-1] + sequence[-2])
                goal.feedback(sequence=np.array(sequence, np.int32))
                if goal.cancel_requested:
                    goal.end(Status.CANCELED, sequence=np.array(sequence, np.int32))
                elif len(sequence) > goal.message.order:
                    goal.end(Status.SUCCEEDED, sequence=np.array(sequence, np.int32))
            relay.step()
            time.sleep(0.05)
    found = relay.found
    assert found["accepted"] == [True, True]
    assert found["status"] == [Status.SUCCEEDED, Status.CANCELED]
    assert found["sequence"] == [0, 1, 1, 2, 3, 5]
    assert [0, 1, 1, 2] in found["feedback"]
    assert found["canceling"] == 1


PARTS = {
    "send_goal": f"{FIBONACCI}_SendGoal",
    "cancel_goal": "action_msgs/srv/CancelGoal",
    "get_result": f"{FIBONACCI}_GetResult",
}
"""Service of each part of the action."""


class Relay:
    """Pipe to the peer's client, whose requests become calls of the wire."""

    def __init__(self, graph: Graph, python: str) -> None:
        node, parts = graph.node("relay"), "/fibonacci/_action"
        self._clients = {p: node.client(f"{parts}/{p}", kind) for p, kind in PARTS.items()}
        feedback = node.subscription(f"{parts}/feedback", f"{FIBONACCI}_FeedbackMessage")
        status = node.subscription(f"{parts}/status", "action_msgs/msg/GoalStatusArray", LATCHED)
        self._topics = {"feedback": feedback, "status": status}
        self._calls: dict[str, Call] = {}
        self._lines: deque[str] = deque()
        self.found: dict[str, Any] | None = None
        until(lambda: all(client.matched for client in self._clients.values()))
        self.peer = subprocess.Popen(
            [python, str(HERE / "rclpy_action_peer.py")],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self.peer.stdout is not None
        self._lines.extend(iter(self.peer.stdout.readline, ""))

    def step(self) -> None:
        """Passes on what has come from either side."""
        while self._lines:
            id, part, *payload = self._lines.popleft().split(maxsplit=2)
            if id == "done":
                self.found = json.loads(" ".join([part, *payload]))
                return
            request = decoded(bytes.fromhex(payload[0]), f"{PARTS[part]}_Request")
            self._calls[id] = self._clients[part].call(request, 60.0)
        for id, call in list(self._calls.items()):
            if (response := call.take()) is not None:
                del self._calls[id]
                self._send(id, response)
        for name, subscription in self._topics.items():
            for message in subscription.take():
                self._send(name, message)

    def _send(self, target: str, message: Any) -> None:
        assert self.peer.stdin is not None
        self.peer.stdin.write(f"{target} {encoded(message).hex()}\n")
        self.peer.stdin.flush()

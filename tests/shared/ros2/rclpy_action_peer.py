"""Real ActionClient of rclpy, and the relay by which it reaches a server of another middleware.

    python rclpy_action_peer.py

The client's middleware is Fast DDS. Its requests leave as lines `ID PART HEX` on standard output,
answers come as `ID HEX`, messages of topics as `feedback HEX` and `status HEX` on standard input.
It follows one goal to its result, cancels another, and prints `done JSON`.
"""

# pyright: reportMissingImports=none

from __future__ import annotations

import itertools
import json
import queue
import sys
import threading
from typing import Any

import rclpy
from action_msgs.msg import GoalStatusArray
from action_msgs.srv import CancelGoal
from rclpy.action import ActionClient
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message, serialize_message
from test_msgs.action import Fibonacci

NAME = "/fibonacci"
SERVICES = {
    "send_goal": Fibonacci.Impl.SendGoalService,
    "cancel_goal": CancelGoal,
    "get_result": Fibonacci.Impl.GetResultService,
}


class Relay:
    """Services and topics of the action, whose server stands behind the pipe."""

    def __init__(self, node: Any) -> None:
        self._answers: dict[int, queue.Queue[bytes]] = {}
        self._ids = itertools.count(1)
        self._lock = threading.Lock()
        group = ReentrantCallbackGroup()
        for part, kind in SERVICES.items():
            node.create_service(
                kind,
                f"{NAME}/_action/{part}",
                lambda request, response, part=part: self._ask(part, request, type(response)),
                callback_group=group,
            )
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        feedback = Fibonacci.Impl.FeedbackMessage
        self._topics = {
            "feedback": (feedback, node.create_publisher(feedback, f"{NAME}/_action/feedback", 10)),
            "status": (
                GoalStatusArray,
                node.create_publisher(GoalStatusArray, f"{NAME}/_action/status", latched),
            ),
        }
        threading.Thread(target=self._read, daemon=True).start()

    def _ask(self, part: str, request: Any, response: type) -> Any:
        with self._lock:
            id = next(self._ids)
            self._answers[id] = queue.Queue()
            print(id, part, serialize_message(request).hex(), flush=True)
        return deserialize_message(self._answers[id].get(timeout=60.0), response)

    def _read(self) -> None:
        for line in sys.stdin:
            target, payload = line.split()
            content = bytes.fromhex(payload)
            if target in self._topics:
                kind, publisher = self._topics[target]
                publisher.publish(deserialize_message(content, kind))
            else:
                self._answers[int(target)].put(content)


def wait(future: Any) -> Any:
    ready = threading.Event()
    future.add_done_callback(lambda _: ready.set())
    assert ready.wait(60.0), "rclpy has waited for a minute"
    return future.result()


def main() -> None:
    rclpy.init()
    node = rclpy.create_node("client")
    relay = Relay(node)
    client = ActionClient(node, Fibonacci, NAME)
    executor = MultiThreadedExecutor(8)
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    assert client.wait_for_server(30.0)
    heard: list[list[int]] = []
    goal = wait(
        client.send_goal_async(
            Fibonacci.Goal(order=5), lambda f: heard.append(list(f.feedback.sequence))
        )
    )
    result = wait(goal.get_result_async())
    other = wait(client.send_goal_async(Fibonacci.Goal(order=50)))
    ending = other.get_result_async()
    cancel = wait(other.cancel_goal_async())
    cancelled = wait(ending)
    found = {
        "accepted": [goal.accepted, other.accepted],
        "status": [result.status, cancelled.status],
        "sequence": list(result.result.sequence),
        "feedback": heard,
        "canceling": len(cancel.goals_canceling),
    }
    print("done", json.dumps(found), flush=True)
    del relay


main()

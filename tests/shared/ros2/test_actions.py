"""Actions: goals are accepted, reported on, cancelled and answered."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack

import numpy as np
import pytest

from shared.ros2.actions import MAX_GOALS, ActionClient, ActionServer, ServerGoal, Status
from shared.ros2.node import Call
from shared.ros2.types import define_action, nanoseconds, ros, time
from tests.shared.cell import until
from tests.shared.ros2.graph import Graph

FIBONACCI = "test_msgs/action/Fibonacci"


class Pair:
    """Server and client of one action."""

    def __init__(self, graph: Graph) -> None:
        define_action(FIBONACCI, "int32 order\n---\nint32[] sequence\n---\nint32[] sequence")
        self.server = ActionServer(graph.first, "/fibonacci", FIBONACCI)
        self.client = ActionClient(graph.node("second"), "/fibonacci", FIBONACCI)
        until(lambda: self.client.matched)

    def send(self, order: int):
        return self.client.send(ros(f"{FIBONACCI}_Goal", order=order))

    def take(self) -> ServerGoal:
        """The next goal, accepted."""
        goals: list[ServerGoal] = []

        def arrived() -> list[ServerGoal]:
            for goal in self.server.take():
                goal.accept()
                goals.append(goal)
            return goals

        until(arrived)
        return goals[0]

    def serve(self) -> None:
        """Answers what has come."""
        for goal in self.server.take():
            goal.reject()


@pytest.fixture
def pair() -> Iterator[Pair]:
    with ExitStack() as stack:
        yield Pair(Graph(stack))


def numbers(*values: int) -> np.ndarray:
    return np.array(values, np.int32)


def test_a_goal_is_reported_on_and_succeeds(pair: Pair):
    sent = pair.send(3)
    goal = pair.take()
    assert goal.message.order == 3
    until(lambda: sent.poll() or sent.accepted)
    goal.feedback(sequence=numbers(0, 1))
    until(lambda: sent.poll() or sent.feedback)
    assert sent.feedback.popleft().sequence.tolist() == [0, 1]
    pair.serve()
    goal.end(Status.SUCCEEDED, sequence=numbers(0, 1, 1))
    until(lambda: pair.serve() or sent.poll() or sent.status)
    assert (sent.status, sent.result.sequence.tolist()) == (Status.SUCCEEDED, [0, 1, 1])


def test_a_goal_is_cancelled(pair: Pair):
    sent = pair.send(3)
    goal = pair.take()
    until(lambda: sent.poll() or sent.accepted)
    sent.cancel()
    until(lambda: pair.serve() or goal.cancel_requested)
    goal.end(Status.CANCELED, sequence=numbers())
    until(lambda: pair.serve() or sent.poll() or sent.status)
    assert sent.status is Status.CANCELED


def test_a_goal_is_rejected(pair: Pair):
    sent = pair.send(3)
    until(lambda: pair.serve() or sent.poll() or sent.accepted is not None)
    assert sent.accepted is False


def test_the_result_of_a_goal_that_has_ended_can_be_asked_for(pair: Pair):
    pair.send(1)
    goal = pair.take()
    goal.end(Status.ABORTED, sequence=numbers(7))
    answer = pair.client.ask_result(goal.id)
    answers: list = []
    until(lambda: pair.serve() or answers.append(answer.take()) or answers[-1])
    assert (answers[-1].status, answers[-1].result.sequence.tolist()) == (Status.ABORTED, [7])


def answer_of(pair: Pair, call: Call):
    answers: list = []
    until(lambda: pair.serve() or answers.append(call.take()) or answers[-1])
    return answers[-1]


def test_the_result_of_an_unknown_goal_is_answered_by_its_status(pair: Pair):
    assert answer_of(pair, pair.client.ask_result(bytes(range(16)))).status == 0


def test_cancellations_are_answered_as_by_rcl(pair: Pair):
    ended, running, later = (pair.send(k) and pair.take() for k in range(3))
    ended.end(Status.SUCCEEDED, sequence=numbers())
    ask = pair.client.send_cancel
    # Unknown goal, goal that has ended.
    assert answer_of(pair, ask(bytes(range(16)))).return_code == 2
    assert answer_of(pair, ask(ended.id)).return_code == 3
    info = ros("action_msgs/msg/GoalInfo", stamp=time(running.accepted_at))
    request = ros("action_msgs/srv/CancelGoal_Request", goal_info=info)
    answer = answer_of(pair, pair.client._cancel.call(request, 20.0))
    # Those accepted up to a time; the answer states when each was.
    (canceling,) = answer.goals_canceling
    assert (answer.return_code, bytes(canceling.goal_id.uuid)) == (0, running.id)
    assert nanoseconds(canceling.stamp) == running.accepted_at
    info.stamp = time(1)
    assert answer_of(pair, pair.client._cancel.call(request, 20.0)).return_code == 0
    assert not later.cancel_requested
    assert len(answer_of(pair, ask(bytes(16))).goals_canceling) == 1
    assert later.cancel_requested


def test_goals_that_have_ended_are_forgotten_before_there_are_too_many(pair: Pair):
    for _ in range(MAX_GOALS + 5):
        pair.send(1)
        pair.take().end(Status.SUCCEEDED, sequence=numbers())
    assert len(pair.server._goals) == MAX_GOALS

"""Services joined in memory on simulated time."""

from __future__ import annotations

import pytest

from lariat.trajectory import SECOND
from shared import topics
from shared.messages import NodeChain, Plan, TaskState, Trace
from shared.runtime.service import Inbox, Publication
from stack.simulation.simulated_time import START, Delivery, SimulatedStack


class Rope:
    """Publishes a rope that moves along x at 1 m/s."""

    name, reads, writes = "sim", (), (topics.ROPE_NODES,)
    rate, latency = 120.0, 0.02

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        yield Publication(topics.ROPE_NODES, NodeChain(stamp=now, positions=[now / SECOND, 0, 0]))


class Listener:
    """Keeps what it saw and publishes the age of it."""

    name, reads = "controller", (topics.ROPE_NODES, topics.TASK_STATE)
    writes = (topics.CONTROLLER_PLAN,)
    rate, latency = 50.0, 0.0

    def __init__(self) -> None:
        self.seen: list[tuple[int, int]] = []
        self.steps: list[int] = []

    def warm_up(self) -> None: ...

    def step(self, inbox: Inbox, now: int):
        self.steps.append(now)
        rope = inbox.fresh(topics.ROPE_NODES)
        if rope:
            self.seen.append((now, rope.message.stamp))
            rope.message.stamp = -1
            yield Publication(topics.CONTROLLER_PLAN, Plan(stamp=now))


def run(seconds: float) -> tuple[Listener, list[Delivery]]:
    log: list[Delivery] = []
    listener = Listener()
    stack = SimulatedStack([Rope(), listener], taps=[log.append])
    stack.warm_up()
    stack.advance_to(START + round(seconds * SECOND))
    return listener, log


def test_outputs_are_visible_their_latency_after_the_step_and_never_before():
    listener, _ = run(1.0)
    ages = [now - stamp for now, stamp in listener.seen]
    assert min(ages) >= 20_000_000
    # The newest image is at most one period of the sim older than the latency.
    assert max(ages) <= 20_000_000 + SECOND // 120 + 1


def test_a_service_steps_at_its_rate_without_drift():
    listener, log = run(10.0)
    assert len(listener.steps) == 500
    assert listener.steps[-1] == START + 499 * SECOND // 50
    sim = [d.parse().now for d in log if d.topic.key == "trace/sim"]
    assert sim == [START + k * SECOND // 120 for k in range(len(sim))]


def test_two_runs_deliver_the_same_bytes():
    (_, first), (_, second) = run(1.0), run(1.0)
    assert first == second
    assert {d.topic.key for d in first} >= {"rope/nodes", "controller/plan", "trace/controller"}


def test_a_trace_names_what_its_step_was_given():
    listener, log = run(0.5)
    rope = {d.sequence: d for d in log if d.topic.key == "rope/nodes"}
    traces = [Trace.FromString(d.payload) for d in log if d.topic.key == "trace/controller"]
    given = [
        (t.now, rope[i.sequence].parse().stamp)
        for t in traces
        for i in t.inputs
        if i.topic == "rope/nodes"
    ]
    assert given == listener.seen


def test_a_reader_cannot_change_what_others_see():
    _, log = run(0.2)
    assert all(d.parse().stamp > 0 for d in log if d.topic.key == "rope/nodes")


def test_a_message_of_another_type_is_refused():
    stack = SimulatedStack([Rope()])
    with pytest.raises(TypeError, match=r"TaskState.*rope/nodes.*NodeChain"):
        stack.send(topics.ROPE_NODES, TaskState())

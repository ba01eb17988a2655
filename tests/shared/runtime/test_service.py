"""Inboxes and mailboxes of services."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from shared import topics
from shared.messages import Health, NodeChain, TaskRequest, timestamp
from shared.runtime.service import Mailbox, Received

COLOR = topics.CAMERA_COLOR.at("overhead")
DEPTH = topics.CAMERA_DEPTH.at("overhead")


def received(message: object, sequence: int = 0) -> Received:
    return Received(message, "publisher-0", sequence, received=1000 + sequence)


def image(topic: topics.Topic, stamp: int) -> Received:
    return received(topic.type(timestamp=timestamp(stamp)), stamp)


def test_a_state_stays_the_latest_and_is_fresh_once() -> None:
    mailbox = Mailbox([topics.ROPE_NODES])
    assert mailbox.take().latest(topics.ROPE_NODES) is None
    for stamp in (1, 2, 3):
        mailbox.deliver("rope/nodes", received(NodeChain(stamp=stamp), stamp))
    first, second = mailbox.take(), mailbox.take()
    for inbox, fresh in ((first, True), (second, False)):
        newest = inbox.latest(topics.ROPE_NODES)
        assert newest is not None
        assert newest.message.stamp == 3
        assert (inbox.fresh(topics.ROPE_NODES) is newest) == fresh
    assert mailbox.drops == 2
    assert [i.sequence for i in first.consumed] == [3]
    assert not list(second.consumed)


def test_requests_arrive_completely_and_in_order() -> None:
    mailbox = Mailbox([topics.TASK_REQUEST])
    for k in range(5):
        mailbox.deliver("task/request", received(TaskRequest(id=str(k)), k))
    inbox = mailbox.take()
    assert [r.message.id for r in inbox.every(topics.TASK_REQUEST)] == list("01234")
    assert [i.sequence for i in inbox.consumed] == list(range(5))
    assert mailbox.take().every(topics.TASK_REQUEST) == ()
    assert mailbox.drops == 0


def test_an_inbox_does_not_change_with_later_deliveries() -> None:
    mailbox = Mailbox([topics.ROPE_NODES, topics.TASK_REQUEST])
    mailbox.deliver("rope/nodes", received(NodeChain(stamp=1)))
    inbox = mailbox.take()
    mailbox.deliver("rope/nodes", received(NodeChain(stamp=2)))
    newest = inbox.latest(topics.ROPE_NODES)
    assert newest is not None
    assert newest.message.stamp == 1


@given(st.permutations([(t, s) for t in ("color", "depth") for s in range(1, 5)]))
def test_images_are_joined_by_stamp_in_any_order_of_arrival(
    order: list[tuple[str, int]],
) -> None:
    mailbox = Mailbox([COLOR, DEPTH])
    seen = {"color": set(), "depth": set()}
    last = 0
    for name, stamp in order:
        topic = COLOR if name == "color" else DEPTH
        mailbox.deliver(topic.key, image(topic, stamp))
        seen[name].add(stamp)
        pair = mailbox.take().joined(COLOR, DEPTH)
        whole = max(seen["color"] & seen["depth"], default=0)
        if pair is None:
            assert whole <= last
        else:
            assert pair[0].message.timestamp == pair[1].message.timestamp == timestamp(whole)
            assert whole > last
            last = whole
    assert last == 4


def test_incomplete_sets_are_dropped_and_counted() -> None:
    mailbox = Mailbox([COLOR, DEPTH])
    for stamp in range(1, 21):
        mailbox.deliver(COLOR.key, image(COLOR, stamp))
    assert mailbox.take().joined(COLOR, DEPTH) is None
    assert mailbox.drops == 12


def test_keys_of_a_topic_with_a_placeholder_are_kept_apart() -> None:
    mailbox = Mailbox([topics.HEALTH])
    for name in ("sim", "planner"):
        mailbox.deliver(f"health/{name}", received(Health(service=name)))
    inbox = mailbox.take()
    for name in ("sim", "planner"):
        newest = inbox.latest(topics.HEALTH.at(name))
        assert newest is not None
        assert newest.message.service == name
    assert inbox.latest(topics.HEALTH.at("controller")) is None
    assert mailbox.drops == 0


def test_images_of_two_cameras_are_joined_each_by_itself() -> None:
    side = [topic.at("side") for topic in (topics.CAMERA_COLOR, topics.CAMERA_DEPTH)]
    mailbox = Mailbox([COLOR, DEPTH, *side])
    for topic in side:
        mailbox.deliver(topic.key, image(topic, 5))
    mailbox.deliver(COLOR.key, image(COLOR, 7))
    inbox = mailbox.take()
    assert inbox.joined(*side) is not None
    assert inbox.joined(COLOR, DEPTH) is None
    mailbox.deliver(DEPTH.key, image(DEPTH, 7))
    assert mailbox.take().joined(COLOR, DEPTH) is not None

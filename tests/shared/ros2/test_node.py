"""Nodes: topics, latched topics and services between two sessions."""

from __future__ import annotations

import time
from collections.abc import Iterator
from contextlib import ExitStack

import pytest
import zenoh

from shared.bus import BusError
from shared.ros2.node import HEARTBEAT, REQUEST_CAPACITY, Node
from shared.ros2.types import decoded, encoded, ros
from shared.ros2.wire import LATCHED, Attachment, Qos
from shared.runtime.free_port import free_port
from tests.shared.cell import until
from tests.shared.ros2.graph import Graph

pytestmark = pytest.mark.live

STRING, TRIGGER = "std_msgs/msg/String", "std_srvs/srv/Trigger"


@pytest.fixture
def graph() -> Iterator[Graph]:
    with ExitStack() as stack:
        yield Graph(stack)


def text(data: str):
    return ros(STRING, data=data)


def test_the_first_node_serves_the_router_that_others_join(graph: Graph):
    assert graph.first.serves_router
    assert not graph.node("second").serves_router


def test_a_port_without_router_that_is_taken_is_named():
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(BusError, match=str(port)):
            Node("lonely", router=f"tcp/127.0.0.1:{port}")


def test_messages_arrive_in_order_and_the_newest_are_kept(graph: Graph):
    publisher = graph.first.publisher("/chatter", STRING)
    subscription = graph.node("second").subscription("/chatter", STRING)
    until(lambda: publisher.matched)
    for k in range(15):
        publisher.put(text(str(k)))
    time.sleep(0.5)
    kept = [m.data for m in subscription.take()]
    assert kept == [str(k) for k in range(15 - subscription.entity.qos.depth, 15)]


def test_who_comes_later_gets_the_last_latched_message(graph: Graph):
    publisher = graph.first.publisher("/map", STRING, LATCHED)
    publisher.put(text("old"))
    publisher.put(text("new"))
    subscription = graph.node("second").subscription("/map", STRING, LATCHED)
    got: list[str] = []

    def arrived() -> bool:
        got.extend(m.data for m in subscription.take())
        return bool(got)

    until(arrived)
    assert got == ["new"]


def test_the_number_of_a_latched_message_is_told_once(graph: Graph):
    publisher = graph.first.publisher("/map", STRING, LATCHED)
    heartbeats: list[zenoh.Sample] = []
    watcher = graph.node("second")._session
    subscriber = watcher.declare_subscriber(f"{publisher.entity.key}/@adv/**", heartbeats.append)
    publisher.put(text("new"))
    until(lambda: heartbeats)
    time.sleep(3 * HEARTBEAT)
    assert len(heartbeats) == 1
    subscriber.undeclare()


@pytest.mark.parametrize("qos", [LATCHED, Qos(reliable=False, latched=True, depth=2)])
def test_latched_messages_reach_those_who_come_later_whatever_the_reliability(
    graph: Graph, qos: Qos
):
    publisher = graph.first.publisher("/map", STRING, qos)
    for k in range(4):
        publisher.put(text(str(k)))
    subscription = graph.node("second").subscription("/map", STRING, qos)
    got: list[str] = []
    until(lambda: got.extend(m.data for m in subscription.take()) or len(got) >= qos.depth)
    assert got == [str(k) for k in range(4 - qos.depth, 4)]


def test_a_service_is_in_the_graph_only_when_it_can_be_called(
    graph: Graph, monkeypatch: pytest.MonkeyPatch
):
    called: list[str] = []
    session = graph.first._session

    class Watched:
        def __getattr__(self, name: str):
            called.append(name)
            return getattr(session, name)

    monkeypatch.setattr(graph.first, "_session", Watched())
    graph.first.service("/start", TRIGGER)
    assert called == ["declare_queryable", "liveliness"]


def test_a_service_answers_now_or_later(graph: Graph):
    service = graph.first.service("/start", TRIGGER)
    client = graph.node("second", "/cell").client("/start", TRIGGER)
    until(lambda: client.matched)
    call = client.call(ros(f"{TRIGGER}_Request"), 20.0)
    asked = []
    until(lambda: asked.extend(service.take()) or asked)
    assert call.take() is None
    asked[0].reply(ros(f"{TRIGGER}_Response", success=True, message="started"))
    answers = []
    until(lambda: answers.append(call.take()) or answers[-1])
    assert (answers[-1].success, answers[-1].message) == (True, "started")


def test_a_service_that_is_not_there_does_not_answer(graph: Graph):
    call = graph.first.client("/nowhere", TRIGGER).call(ros(f"{TRIGGER}_Request"), 0.2)
    time.sleep(0.3)
    with pytest.raises(TimeoutError):
        call.take()


def test_garbage_is_refused_and_counted_and_the_rest_arrives(graph: Graph):
    subscription = graph.first.subscription("/chatter", STRING)
    service = graph.first.service("/start", TRIGGER)
    stranger = graph.node("stranger")
    publisher = stranger.publisher("/chatter", STRING)
    until(lambda: publisher.matched)
    raw = publisher._publisher  # A stranger keeps to no convention.
    good = Attachment(1, 0, bytes(16)).encoded()
    raw.put(b"", attachment=good)
    raw.put(b"\x00\x01\x00\x00\xff\xff\xff\xff", attachment=good)
    raw.put(encoded(text("without attachment")))
    raw.put(encoded(text("short")), attachment=b"1")
    publisher.put(text("hello"))
    got: list[str] = []
    until(lambda: got.extend(m.data for m in subscription.take()) or got)
    assert got == ["hello"]
    assert graph.first.door.refused == 4
    replies: list[zenoh.Reply] = []
    stranger._session.get(
        service.entity.key, replies.append, payload=b"nonsense", attachment=good, timeout=5.0
    )
    until(lambda: list(service.take()) or replies)
    assert replies[0].err is not None
    assert graph.first.door.refused == 5


def test_another_hash_is_another_topic_and_a_stolen_identifier_hides_nobody(graph: Graph):
    subscription = graph.first.subscription("/chatter", STRING)
    service = graph.first.service("/start", TRIGGER)
    honest, stranger = graph.node("honest"), graph.node("stranger")
    publisher, client = honest.publisher("/chatter", STRING), honest.client("/start", TRIGGER)
    entity = publisher.entity
    wrong = entity.key.replace("RIHS01_d", "RIHS01_e")
    token = entity.token.replace("RIHS01_d", "RIHS01_e")
    stranger._kept.append(stranger._session.liveliness().declare_token(token))
    until(lambda: publisher.matched and client.matched)
    # The identifier, and the number, of the honest publisher's next sample.
    stolen = Attachment(1, 0, entity.gid).encoded()
    stranger._session.put(wrong, encoded(text("wrong hash")), attachment=stolen)
    stranger._session.put(entity.key, encoded(text("stolen")), attachment=stolen)
    publisher.put(text("honest"))
    got: list[str] = []
    until(lambda: got.extend(m.data for m in subscription.take()) or len(got) > 1)
    assert sorted(got) == ["honest", "stolen"]
    # Two requests of one identifier and number: each gets its own answer.
    request = encoded(ros(f"{TRIGGER}_Request"))
    asked = Attachment(1, 0, client.entity.gid).encoded()
    replies: list[zenoh.Reply] = []
    stranger._session.get(service.entity.key, replies.append, payload=request, attachment=asked)
    call, answered = client.call(ros(f"{TRIGGER}_Request"), 5.0), []
    until(lambda: answered.extend(service.take()) or len(answered) == 2)
    for k, each in enumerate(answered):
        each.reply(ros(f"{TRIGGER}_Response", success=True, message=str(k)))
    until(lambda: replies and call.replies)
    assert replies[0].ok is not None
    theirs = decoded(replies[0].ok.payload.to_bytes(), f"{TRIGGER}_Response")
    assert {call.take().message, theirs.message} == {"0", "1"}


def test_a_flood_of_requests_is_bounded(graph: Graph):
    service = graph.first.service("/start", TRIGGER)
    client = graph.node("second").client("/start", TRIGGER)
    until(lambda: client.matched)
    calls = [client.call(ros(f"{TRIGGER}_Request"), 20.0) for _ in range(10 * REQUEST_CAPACITY)]
    time.sleep(1.0)
    assert len(list(service.take())) == REQUEST_CAPACITY
    assert len(calls) == 10 * REQUEST_CAPACITY


def test_domains_do_not_hear_each_other(graph: Graph):
    publisher = graph.first.publisher("/chatter", STRING)
    other = Node("other", domain=7, router=graph.router)
    try:
        other.subscription("/chatter", STRING)
        time.sleep(0.5)
        assert not publisher.matched
    finally:
        other.close()


def test_messages_of_another_machine_come_by_its_router(graph: Graph):
    # 127.0.0.2 plays the other machine, whose nodes accept only those of it.
    router = f"tcp/127.0.0.2:{free_port()}"
    there, here = Node("router", router=router), Node("here", router=router)
    try:
        publisher = there.publisher("/chatter", STRING)
        subscription = here.subscription("/chatter", STRING)
        until(lambda: publisher.matched)
        publisher.put(text("hello"))
        got: list[str] = []
        until(lambda: got.extend(m.data for m in subscription.take()) or got)
        assert len(here._session.info.routers_zid()) == 1
        # A peer would wait for connections that cannot come.
        info = there._session.info
        assert (len(info.peers_zid()), here.serves_router) == (0, False)
    finally:
        here.close()
        there.close()


def test_a_free_port_is_served():
    node = Node("alone", router=f"tcp/127.0.0.1:{free_port()}")
    assert node.serves_router
    node.close()

from __future__ import annotations

import json
import logging
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
import zenoh

from shared import bus as buses
from shared import topics
from shared.bus import BusError, BusOptions
from shared.messages import Health, NodeChain, TaskRequest, TaskState
from shared.runtime.free_port import free_port
from shared.topics import RawImage
from shared.version import MESSAGE_VERSION
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live


@pytest.fixture
def cell() -> Iterator[Cell]:
    with ExitStack() as stack:
        yield Cell(stack)


def test_a_message_arrives_with_its_publisher_and_number(cell: Cell) -> None:
    subscription = cell("reader").subscribe(topics.TASK_REQUEST)
    publisher = cell("writer-1").publisher(topics.TASK_REQUEST)
    until(lambda: publisher.has_subscribers)
    before = time.time_ns()
    for k in range(3):
        publisher.put(TaskRequest(id=f"r{k}", key="κ"))
    received = []
    until(lambda: received.extend(subscription.take()) or len(received) == 3)
    assert [(key, item.publisher, item.sequence) for key, item in received] == [
        ("task/request", "writer-1", k) for k in range(3)
    ]
    assert [item.message for _, item in received] == [
        TaskRequest(id=f"r{k}", key="κ") for k in range(3)
    ]
    assert all(before <= item.received <= time.time_ns() for _, item in received)
    assert subscription.lost == 0


def test_of_two_peers_only_the_one_with_the_greater_id_connects(cell: Cell, tmp_path: Path) -> None:
    """Where both connect at once, each may close the other's link, and neither tries again."""
    ports = {str(number): free_port() for number in (3, 5, 1, 4, 2)}
    sessions = {}
    for name, port in ports.items():
        settings = tmp_path / f"{name}.json"
        settings.write_text(json.dumps({"id": name}))
        listen = f"tcp/127.0.0.1:{port}"
        options = BusOptions(cell.namespace, (cell.hub,), (listen,), settings=settings)
        sessions[name] = cell.join(options, name)._session
    for name, session in sessions.items():
        others = ports.keys() - {name}
        until(lambda s=session, o=others: o <= {str(link.zid) for link in s.info.links()})
        for link in session.info.links():
            if str(link.zid) in others:
                listens = name if name < str(link.zid) else str(link.zid)
                assert f":{ports[listens]}" in (link.src + link.dst)


def test_no_process_needs_the_shared_memory_of_the_machine(cell: Cell) -> None:
    """Any user of the machine may fill it."""
    session = cell("peer")._session
    until(session.info.transports)
    assert not any(transport.is_shm for transport in session.info.transports())  # pyright: ignore[reportAttributeAccessIssue]


def test_a_slow_reader_gets_the_newest_state_and_counts_the_others(
    cell: Cell,
) -> None:
    subscription = cell("reader").subscribe(topics.ROPE_NODES)
    publisher = cell("writer").publisher(topics.ROPE_NODES)
    until(lambda: publisher.has_subscribers)
    publisher.put(NodeChain(stamp=0))
    until(subscription.take)
    for k in range(1, 100):
        publisher.put(NodeChain(stamp=k))
    stamps = []
    until(
        lambda: stamps.extend(i.message.stamp for _, i in subscription.take()) or 99 in stamps[-1:]
    )
    assert stamps == sorted(stamps)
    assert subscription.lost == 99 - len(stamps)


def test_a_reader_that_does_not_read_never_delays_the_writer(cell: Cell) -> None:
    subscription = cell("reader").subscribe(topics.TASK_REQUEST)
    publisher = cell("writer").publisher(topics.TASK_REQUEST)
    until(lambda: publisher.has_subscribers)
    publisher.put(TaskRequest())
    until(subscription.take)
    slowest = 0.0
    for _ in range(3000):
        start = time.perf_counter()
        publisher.put(TaskRequest(value="x" * 1000))
        slowest = max(slowest, time.perf_counter() - start)
    assert slowest < 0.5
    received = []
    until(lambda: received.extend(subscription.take()) or received[-1:])
    until(lambda: received.extend(subscription.take()) or received[-1][1].sequence == 3000)
    assert len(received) + subscription.lost == 3000
    assert subscription.lost > 2000


def test_a_frozen_process_delays_no_writer_and_is_no_longer_alive(
    cell: Cell,
) -> None:
    """A stopped process reads nothing: its connection fills, and the writer must not care."""
    writer = cell("writer")
    publisher = writer.publisher(topics.TASK_REQUEST)
    code = (
        "import sys, time\n"
        "from shared import bus, topics\n"
        "options = bus.BusOptions(sys.argv[1], (sys.argv[2],))\n"
        "with bus.open(options, 'frozen') as b:\n"
        "    s = b.subscribe(topics.TASK_REQUEST); b.declare_alive('frozen')\n"
        "    time.sleep(30)\n"
    )
    arguments = [sys.executable, "-c", code, cell.namespace, cell.hub]
    process = subprocess.Popen(arguments)
    try:
        until(lambda: publisher.has_subscribers)
        until(lambda: writer.alive() == {"frozen"})
        process.send_signal(19)  # SIGSTOP
        start = time.monotonic()
        slowest = 0.0
        while time.monotonic() < start + 1.0:
            begin = time.perf_counter()
            publisher.put(TaskRequest(value="x" * 10_000))
            slowest = max(slowest, time.perf_counter() - begin)
            time.sleep(0.001)
        assert slowest < 0.5
        until(lambda: writer.alive() == set(), seconds=4.0)
    finally:
        process.kill()
        process.wait()


def test_a_connection_to_a_frozen_process_closes_at_once(cell: Cell) -> None:
    """Where closing waits for the data to be read, all other connections wait as well."""
    code = (
        "import sys, time\n"
        "from shared import bus, topics\n"
        "with bus.open(bus.BusOptions(sys.argv[1], (sys.argv[2],)), 'frozen') as b:\n"
        "    s = b.subscribe(topics.CAMERA_DEPTH)\n"
        "    time.sleep(30)\n"
    )
    process = subprocess.Popen([sys.executable, "-c", code, cell.namespace, cell.hub])
    try:
        with buses.open(BusOptions(cell.namespace, (cell.hub,)), "writer") as writer:
            publisher = writer.publisher(topics.CAMERA_DEPTH.at("overhead"))
            until(lambda: publisher.has_subscribers)
            process.send_signal(19)  # SIGSTOP
            for _ in range(50):
                publisher.put(RawImage(data=bytes(614_400)))
            begin = time.monotonic()
        assert time.monotonic() - begin < 5.0
    finally:
        process.kill()
        process.wait()


def test_messages_of_a_wrong_type_or_version_are_dropped_and_logged(
    cell: Cell, caplog: pytest.LogCaptureFixture
) -> None:
    subscription = cell("reader").subscribe(topics.TASK_REQUEST)
    cell("honest")
    config = zenoh.Config()
    for key, value in {
        "mode": "peer",
        "namespace": cell.namespace,
        "connect/endpoints": [cell.hub],
        "listen/endpoints": ["tcp/127.0.0.1:0"],
        "scouting/multicast/enabled": False,
        "transport/shared_memory/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    typed = zenoh.Encoding("application/protobuf;lariat.TaskRequest")
    with zenoh.open(config) as stranger, caplog.at_level(logging.WARNING):
        publisher = stranger.declare_publisher("task/request")
        until(lambda: publisher.matching_status.matching)  # pyright: ignore[reportAttributeAccessIssue]
        publisher.put(b"\xff\xff\xff", encoding=typed, attachment=b"7 stranger")
        publisher.put(b"", encoding=zenoh.Encoding("text/plain"), attachment=b"\xff\x00")
        publisher.put(b"")
        publisher.put(b"", encoding=typed, attachment=b"8 newcomer 99")
        publisher.put(TaskRequest(id="good").SerializeToString(), encoding=typed)
        received = []
        until(lambda: received.extend(subscription.take()) or received)
    assert [item.message.id for _, item in received] == ["good"]
    assert subscription.refused == 4
    assert all(w in caplog.text for w in ("refused task/request from stranger", "3 bytes"))
    refusal = f"message version 99, this process reads versions up to {MESSAGE_VERSION}; update"
    assert refusal in caplog.text


def test_a_topic_with_a_placeholder_matches_all_its_keys(cell: Cell) -> None:
    subscription = cell("reader").subscribe(topics.HEALTH)
    writer = cell("writer")
    for name in ("sim", "planner"):
        publisher = writer.publisher(topics.HEALTH.at(name))
        until(lambda p=publisher: p.has_subscribers)
        publisher.put(Health(service=name))
    received = []
    until(lambda: received.extend(subscription.take()) or len(received) == 2)
    assert [key for key, _ in received] == ["health/sim", "health/planner"]
    with pytest.raises(ValueError, match="has a placeholder"):
        writer.publisher(topics.HEALTH)


def test_a_raw_subscription_gets_all_messages_of_its_own_cell_only(cell: Cell) -> None:
    everything = cell("recorder").subscribe_all()
    other = BusOptions("another-cell", (cell.hub,))
    with buses.open(other, "stranger") as neighbour:
        neighbour.publisher(topics.ROPE_TRUTH).put(NodeChain(stamp=1))
        publisher = cell("sim-0").publisher(topics.ROPE_TRUTH)
        until(lambda: publisher.has_subscribers)
        neighbour.publisher(topics.ROPE_TRUTH).put(NodeChain(stamp=2))
        chain = NodeChain(stamp=3, positions=[1.0, 2.0, 3.0] * 2)
        publisher.put(NodeChain(stamp=4, positions=[1.0]))
        publisher.put(chain)
        received = []
        until(lambda: received.extend(everything.take()) or received)
    assert [(r.key, r.type, r.publisher, r.sequence) for r in received] == [
        ("rope/truth", "lariat.NodeChain", "sim-0", 1)
    ]
    assert everything.refused == 1
    assert received[0].payload == chain.SerializeToString()


def test_a_raw_subscription_gets_each_message_of_its_own_process_once(cell: Cell) -> None:
    recorder = cell("recorder-0")
    everything = recorder.subscribe_all()
    publisher, other = (bus.publisher(topics.ROPE_TRUTH) for bus in (recorder, cell("sim-0")))
    until(lambda: other.has_subscribers)
    chain = NodeChain(stamp=3, positions=[1.0, 2.0, 3.0] * 2)
    publisher.put(chain)
    other.put(chain)
    received = []
    until(lambda: received.extend(everything.take()) or len(received) > 1)
    assert [(r.key, r.type, r.publisher, r.sequence, r.payload) for r in received] == [
        ("rope/truth", "lariat.NodeChain", name, 0, chain.SerializeToString())
        for name in ("recorder-0", "sim-0")
    ]
    assert received[0].published == received[0].received > 0


def test_a_wrong_type_is_not_sent(cell: Cell) -> None:
    publisher = cell("writer").publisher(topics.ROPE_NODES)
    with pytest.raises(TypeError, match=r"rope/nodes.*NodeChain.*Health"):
        publisher.put(Health())


def test_an_error_names_the_reason_why_the_bus_cannot_be_joined(tmp_path: Path) -> None:
    hub = f"tcp/127.0.0.1:{free_port()}"
    with (
        pytest.raises(BusError, match=rf"{hub}.*`lariat up`"),
        buses.open(BusOptions(connect=(hub,)), "late", timeout=0.3),
    ):
        pass
    options = BusOptions(connect=(), listen=(hub,))
    with (
        buses.open(options, "first"),
        pytest.raises(BusError, match=f"{hub} is taken"),
        buses.open(options, "second"),
    ):
        pass
    settings = tmp_path / "settings.json"
    settings.write_text('{"transport/link/tx/leese": 1}')
    with (
        pytest.raises(BusError, match="transport/link/tx/leese = 1"),
        buses.open(BusOptions(connect=(), settings=settings), "wrong"),
    ):
        pass


def test_a_message_larger_than_its_topic_allows_never_arrives(cell: Cell) -> None:
    subscription = cell("reader").subscribe(topics.TASK_REQUEST)
    publisher = cell("writer").publisher(topics.TASK_REQUEST)
    until(lambda: publisher.has_subscribers)
    publisher.put(TaskRequest(value="x" * (2 * topics.TASK_REQUEST.max_size)))
    publisher.put(TaskRequest(id="small"))
    received = []
    until(lambda: received.extend(subscription.take()) or received)
    assert [item.message.id for _, item in received] == ["small"]
    assert subscription.refused == 0


def test_taking_ends_although_messages_arrive_faster_than_they_are_read(
    cell: Cell, monkeypatch: pytest.MonkeyPatch
) -> None:
    subscription = cell("reader").subscribe(topics.TASK_REQUEST)
    publisher = cell("writer").publisher(topics.TASK_REQUEST)
    until(lambda: publisher.has_subscribers)
    publisher.put(TaskRequest())
    samples = []
    until(lambda: samples.extend(subscription._ring.take()) or samples)
    monkeypatch.setattr(subscription._ring, "_next", lambda: samples[0])
    assert len(subscription.take()) == 512


def test_a_slow_reader_of_one_topic_delays_no_other_one_and_gets_the_newest(cell: Cell) -> None:
    reader, writer = cell("reader"), cell("writer")
    busy = threading.Event()
    slow = reader.subscribe(topics.TASK_STATE, arrived=lambda: busy.wait(20.0))
    other = reader.subscribe(topics.TASK_REQUEST)
    states, requests = writer.publisher(topics.TASK_STATE), writer.publisher(topics.TASK_REQUEST)
    until(lambda: states.has_subscribers and requests.has_subscribers)
    sent, taken = 0, []

    def send() -> bool:
        nonlocal sent
        for _ in range(200):
            sent += 1
            states.put(TaskState(reset_count=sent))
        requests.put(TaskRequest())
        taken.extend(other.take())
        return sent > 2000

    until(send)
    taken.clear()
    until(lambda: send() and taken)
    busy.set()
    until(lambda: [item.message.reset_count for _, item in slow.take()] == [sent])


def test_a_reader_that_fails_takes_the_next_message_all_the_same(cell: Cell) -> None:
    count = 0

    def fail() -> None:
        nonlocal count
        count += 1
        raise KeyError

    subscription = cell("reader").subscribe(topics.TASK_STATE, arrived=fail)
    publisher = cell("writer").publisher(topics.TASK_STATE)
    until(lambda: publisher.has_subscribers)
    until(lambda: publisher.put(TaskState()) or count > 1)
    assert subscription.refused >= 1


def test_made_up_keys_of_a_topic_fill_no_memory(cell: Cell) -> None:
    subscription = cell("reader").subscribe(topics.HEALTH)
    stranger = cell("stranger")
    keys: set[str] = set()
    for k in range(0, 2 * buses.MAX_KEYS, 16):
        publishers = [stranger.publisher(topics.HEALTH.at(f"x{k + j}")) for j in range(16)]
        until(lambda p=publishers: all(each.has_subscribers for each in p))
        for publisher in publishers:
            publisher.put(Health())

        def arrived(count: int = k + 16) -> bool:
            keys.update(key for key, _ in subscription.take())
            return len(keys) + subscription.refused == count

        until(arrived)
    assert len(keys) == buses.MAX_KEYS
    assert subscription.refused == buses.MAX_KEYS


def test_a_crowd_that_says_nothing_keeps_nobody_from_joining() -> None:
    port = free_port()
    hub = f"tcp/127.0.0.1:{port}"
    with ExitStack() as stack:
        stack.enter_context(buses.open(BusOptions("cell", (), (hub,)), "hub"))
        for _ in range(300):
            stack.enter_context(socket.create_connection(("127.0.0.1", port)))
        stack.enter_context(buses.open(BusOptions("cell", (hub,)), "late", timeout=2.0))

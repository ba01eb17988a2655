"""Processes, buses and readers of files under hostile input.

A target is a context manager that yields what it may be given, as a strategy of hypothesis, and a
function that gives it one example and returns how many inputs passed the check. Whatever that
function raises is a failure.
"""

from __future__ import annotations

import io
import os
import secrets
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
from hypothesis import strategies as st

from benchmarks.faults.fuzz.strategies import raw_messages, spoiled
from benchmarks.faults.hostile_publisher import (
    ENCODING,
    Options,
    hostile_attachment,
    open_session,
)
from benchmarks.live_stack import free_port
from benchmarks.speed.pages import OpenPages
from dashboard.options import DashboardOptions
from dashboard.service import build as build_dashboard
from lariat.configuration import ConfigurationError
from lariat.files.bounded_file import read_file
from lariat.files.image_header import check_image
from lariat.files.mesh_file import HEADER_SIZE, RECORD, read_mesh
from lariat.geometry.mesh_cover import cover_mesh
from lariat.geometry.obstacle_checks import MAX_SIZE
from lariat.scenario import SIDES, Scenario, find, load, parse
from lariat.trajectory import SECOND
from shared import bus as buses
from shared.bus import BusOptions
from shared.bus.message_check import MessageCheck, RawMessage
from shared.recording import Recording, Writer, copy_readable
from shared.runtime.service import Mailbox, Received, Service
from shared.topics import (
    ARM_STATE,
    HEALTH,
    ROPE_NODES,
    STACK_REQUEST,
    TASK_STATE,
    TOPICS,
    Topic,
)
from stack import services
from stack.launcher.console import ProcessConsole
from stack.launcher.launcher import Launcher
from stack.launcher.process import Program
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.library import ScenarioLibrary
from stack.scenario_manager.scenario_manager import ScenarioManager
from stack.simulation.simulated_time import START, Delivery, SimulatedStack

Target = tuple[st.SearchStrategy[Any], Callable[[Any], int]]
"""Strategy of the examples, and function that gives one of them to the target."""
Messages = Sequence[tuple[Topic, RawMessage]]
"""Hostile messages with their topics."""

LAWFUL_TIME = SECOND
"""Simulated time of the ordinary run whose messages are changed [ns]."""
MAX_MESSAGES = 16
"""Most messages between two steps of a service."""
MAX_TAKES = 20
"""Number of reads after which a launcher is ended, as by a signal."""
STILL = 1e-6
"""Motion of an arm that counts as none [m]."""
CHECK = (sys.executable, "-S", "-c", "")
"""Command that finds every scenario in order."""
READY_AND_IDLE = Program("idle", "benchmarks.faults.fuzz.idle_process", ready_line="ready")
"""Process that the launcher runs."""
OBJ = b"v 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2//1 3//1 -1//1\n"
"""Content of an OBJ file: a tetrahedron."""
MESH_BODIES, MESH_TOLERANCE = 4, 0.005
"""Most bodies of a mesh's cover [-], and how far they may stick out [m]."""


@cache
def ordinary_run(scenario: str) -> list[Delivery]:
    """Return the messages of an ordinary run in simulated time."""
    deliveries: list[Delivery] = []
    members = [services.build(name, load(scenario), f"{name}-0") for name in services.NAMES]
    stack = SimulatedStack(members, [deliveries.append])
    stack.warm_up()
    stack.advance_to(START + LAWFUL_TIME)
    return deliveries


def _hostile(topics: Sequence[Topic], scenario: str) -> st.SearchStrategy[Messages]:
    lawful: dict[str, list[bytes]] = {}
    for delivery in ordinary_run(scenario):
        lawful.setdefault(delivery.key, []).append(delivery.payload)
    drawn = raw_messages(topics, lawful, START)
    return st.lists(drawn, min_size=1, max_size=MAX_MESSAGES)


# Processes


@contextmanager
def service(name: str, scenario: str) -> Iterator[Target]:
    """Service that takes hostile messages among those of an ordinary run."""
    cell = load(scenario)
    # Arms that only a person arms: none may move.
    ends = {side: replace(cell.end(side), arm_automatically=False) for side in SIDES}
    cell = replace(cell, ends=replace(cell.ends, **ends))
    with ExitStack() as cleanup:
        pages = None
        if name == "dashboard":
            member = build_dashboard(cell, "dashboard-0", DashboardOptions(port=free_port()))
            pages = OpenPages(member.address, 1)
            cleanup.callback(pages.close)
        else:
            member = services.build(name, cell, f"{name}-0")
        # A fault behind the door is one that the door hides.
        if door := getattr(member, "door", None):
            door.strict = True
        cleanup.callback(getattr(member, "close", lambda: None))
        member.warm_up()
        step = _Stepping(member, ordinary_run(scenario))

        def give(messages: Messages) -> int:
            accepted = step(messages)
            _check_gateway(member, cell)
            assert pages is None or not pages.closed, f"the page has ended {pages.reason}"
            return accepted

        topics = TOPICS if hasattr(member, "tap") else tuple(member.reads)
        yield _hostile(topics, scenario), give


class _Stepping:
    """Steps of a service with hostile messages, and one lawful message in each."""

    def __init__(self, member: Service, lawful: Sequence[Delivery]) -> None:
        keys = {topic.key for topic in member.reads}
        self._member = member
        self._lawful = [delivery for delivery in lawful if delivery.key in keys]
        self._mailbox, self._check = Mailbox(member.reads), MessageCheck()
        self._check.door.strict = True
        self._steps = 0

    def __call__(self, messages: Messages) -> int:
        """Step with messages, and return the number of those that the check of the bus passes."""
        now = START + round(self._steps * SECOND / self._member.rate)
        tap = getattr(self._member, "tap", None)
        accepted = 0
        for topic, raw in messages:
            message = self._check.decode(topic, raw)
            if message is None:
                continue
            accepted += 1
            if tap:
                tap(raw)
            else:
                received = Received(message, raw.publisher, raw.sequence, now)
                self._mailbox.deliver(raw.key, received)
        if self._lawful:
            lawful = self._lawful[self._steps % len(self._lawful)]
            received = Received(lawful.parse(), lawful.publisher, lawful.sequence, now)
            self._mailbox.deliver(lawful.key, received)
        for _, message in self._member.step(self._mailbox.take(), now):
            message.SerializeToString()
        self._steps += 1
        return accepted


def _check_gateway(member: Service, scenario: Scenario) -> None:
    """Check what the gateway promises: no body vanishes from its scene, and no arm moves."""
    cell = getattr(member, "cell", None)
    if cell is None:
        return
    named = {o.name for o in cell.follower.constraints.collision.scene.obstacles}
    missing = {body.name for body in scenario.bodies} - named
    assert not missing, f"{sorted(missing)} vanished from the scene"
    for grip, start in zip(cell.arms.grips, scenario.grips(scenario.start), strict=True):
        moved = float(np.linalg.norm(grip.position - start.position))
        assert moved < STILL, f"an arm moved by {1e3 * moved:.3f} mm"


class _AllTakenError(Exception):
    """The launcher has read long enough: it ends, as by a signal."""


@contextmanager
def launcher(scenario: str) -> Iterator[Target]:
    """Launcher that runs one process and takes hostile messages, without a bus."""

    def give(messages: Messages) -> int:
        check, queue, accepted, calls = MessageCheck(), list(messages), 0, 0

        def take(topic: Topic) -> list[tuple[str, Received]]:
            nonlocal accepted, calls
            calls += 1
            if calls == MAX_TAKES:
                raise _AllTakenError
            mine = [entry for entry in queue if entry[0].type is topic.type]
            queue[:] = [entry for entry in queue if entry[0].type is not topic.type]
            decoded = [(raw, check.decode(concrete, raw)) for concrete, raw in mine]
            passed = [(raw, message) for raw, message in decoded if message is not None]
            accepted += len(passed)
            return [
                (raw.key, Received(message, raw.publisher, raw.sequence, raw.received))
                for raw, message in passed
            ]

        def subscribe(topic: Topic, own: bool = True) -> SimpleNamespace:
            return SimpleNamespace(take=partial(take, topic))

        bus: Any = SimpleNamespace(
            subscribe=subscribe,
            publisher=lambda topic: SimpleNamespace(put=lambda message: None),
        )
        with tempfile.TemporaryDirectory() as folder:
            first = find(scenario)
            library = ScenarioLibrary(Path(folder, "saved"), first)
            trials = Campaigns(Path(folder, "tables"), Path(folder, "trials"), lambda *_: CHECK[1:])
            programs = (READY_AND_IDLE,)
            switch = ScenarioManager(
                library,
                first,
                Path(folder, "started"),
                lambda _: CHECK,
                trials,
                lambda *_: programs,
            )
            switch.door.strict = True
            console = ProcessConsole(io.StringIO())
            with suppress(_AllTakenError):
                Launcher(programs, bus, console, switch).run(lambda _: None)
        return accepted

    yield _hostile((HEALTH, TASK_STATE, ARM_STATE, STACK_REQUEST), scenario), give


@contextmanager
def bus(scenario: str) -> Iterator[Target]:
    """Subscriptions of a real bus to all topics, one by one and all at once."""
    hub, namespace = f"tcp/127.0.0.1:{free_port()}", f"fuzz-{secrets.token_hex(4)}"
    with ExitStack() as cleanup:
        options = BusOptions(namespace, connect=(), listen=(hub,))
        reader = cleanup.enter_context(buses.open(options, "reader"))
        everything = reader.subscribe_all()
        subscriptions = [reader.subscribe(topic) for topic in TOPICS]
        session = cleanup.enter_context(open_session(Options(hub, namespace)))

        def give(example: tuple[Messages, Any]) -> int:
            messages, rng = example
            for _, raw in messages:
                encoding = rng.choice((ENCODING + raw.type, ENCODING + raw.type, "text/plain", ""))
                attachment = hostile_attachment(rng, raw)
                session.put(raw.key, raw.payload, encoding=encoding, attachment=attachment)
            for subscription in subscriptions:
                subscription.take()
            return len(list(everything.take()))

        yield st.tuples(_hostile(TOPICS, scenario), st.randoms(use_true_random=False)), give


# Readers of files


@contextmanager
def file(name: str, scenario: str) -> Iterator[Target]:
    """One reader of files, which may refuse in one way only."""
    with tempfile.TemporaryDirectory() as folder:
        valid, read, refusal = _readers(load(scenario), Path(folder))[name]

        def give(content: bytes) -> int:
            try:
                read(content)
            except refusal:
                return 0
            return 1

        yield spoiled(valid), give


Reader = tuple[bytes, Callable[[bytes], object], type[Exception]]
"""Valid content, function that reads a content, and the only exception that it may raise."""


def _readers(scenario: Scenario, folder: Path) -> dict[str, Reader]:
    angles = np.linspace(-0.5, 0.5, 46)
    arc = 0.45 * np.stack([np.sin(angles), 0.0 * angles, np.cos(angles)], axis=1)
    nodes = "\n".join(",".join(f"{x:.6f}" for x in row) for row in arc).encode()

    def read_scenario(content: bytes) -> object:
        (folder / "a.toml").write_bytes(content)
        return load(folder / "a.toml")

    def read_nodes(content: bytes) -> object:
        (folder / "nodes.csv").write_bytes(content)
        start = '[start]\nnodes = "nodes.csv"\n[goal]\nnodes = "nodes.csv"\n'
        return parse(f'name = "f"\n[rope]\nlength = 0.45\ndiameter = 0.008\n{start}', folder)

    def read_recording(content: bytes) -> object:
        path = folder / "a.mcap"
        path.write_bytes(content)
        (folder / "b.mcap").unlink(missing_ok=True)
        copy_readable(path, folder / "b.mcap")
        return [entry.parse() for entry in Recording.open(path).messages()]

    def read_picture(content: bytes) -> object:
        (folder / "picture").write_bytes(content)
        data = read_file(folder / "picture", 2**28)
        check_image(data, 2**22)
        with _without_standard_error():
            return cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)

    def cover(name: str, content: bytes) -> object:
        (folder / name).write_bytes(content)
        triangles = read_mesh(folder / name)
        if np.max(np.ptp(triangles.reshape(-1, 3), axis=0)) > MAX_SIZE:
            raise ValueError("too large, as the command says")
        return cover_mesh(triangles, MESH_BODIES, MESH_TOLERANCE)

    picture = np.random.default_rng(0).integers(0, 255, (48, 64, 3), np.uint8)
    png, jpeg = (cv2.imencode(f".{kind}", picture)[1].tobytes() for kind in ("png", "jpg"))
    return {
        "scenario": (scenario.text.encode(), read_scenario, ConfigurationError),
        "nodes": (nodes, read_nodes, ConfigurationError),
        "recording": (_recording(scenario, folder), read_recording, ValueError),
        "png": (png, read_picture, ValueError),
        "jpeg": (jpeg, read_picture, ValueError),
        "stl": (_stl(), partial(cover, "a.stl"), ValueError),
        "obj": (OBJ, partial(cover, "a.obj"), ValueError),
    }


def _stl() -> bytes:
    """Content of a binary STL file: a tetrahedron."""
    corners = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.1, 0.0], [0.0, 0.0, 0.1]])
    rows = np.zeros(4, RECORD)
    rows["corners"] = corners[[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]]
    return bytes(HEADER_SIZE - 4) + len(rows).to_bytes(4, "little") + rows.tobytes()


def _recording(scenario: Scenario, folder: Path) -> bytes:
    """Content of a small recording."""
    path = folder / "valid.mcap"
    writer = Writer(path, scenario, SECOND)
    for k in range(200):
        payload = ROPE_NODES.type(stamp=k, positions=[0.1 * k] * 6).SerializeToString()
        writer.write(ROPE_NODES, payload, "p-0", k, SECOND + k * SECOND // 100)
    writer.close()
    return path.read_bytes()


@contextmanager
def _without_standard_error() -> Iterator[None]:
    """Silence the image library, which reports every damaged image from C."""
    kept, silence = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silence, 2)
        yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(silence)

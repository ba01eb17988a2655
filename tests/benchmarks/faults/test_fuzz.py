"""Hostile messages for every process and the doors of a real bus: none ends, and no arm moves.

FUZZ_COUNT draws of up to sixteen messages for each, anew each time, with that variable.
"""

from __future__ import annotations

import io
import logging
import os
import secrets
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.faults.hostile_messages import DRAWING, Messages, hostile, ordinary_run
from benchmarks.faults.hostile_publisher import open_session, put
from benchmarks.speed.pages import OpenPages
from dashboard.options import DashboardOptions
from dashboard.service import build as build_dashboard
from lariat.scenario import SIDES, Scenario, find, load
from lariat.trajectory import SECOND
from shared import bus as buses
from shared.bus import BusOptions
from shared.bus.message_check import PROTOBUF_ENCODING, MessageCheck
from shared.runtime.free_port import free_port
from shared.runtime.service import Mailbox, Received, Service
from shared.topics import ARM_STATE, HEALTH, STACK_REQUEST, TASK_STATE, TOPICS, Topic
from stack import services
from stack.launcher.console import ProcessConsole
from stack.launcher.launcher import Launcher
from stack.launcher.process import Program
from stack.scenario_manager.campaign.campaigns import Campaigns
from stack.scenario_manager.library import ScenarioLibrary
from stack.scenario_manager.scenario_manager import ScenarioManager
from stack.simulation.simulated_time import START, Delivery

COUNT = "FUZZ_COUNT"
"""Variable of the environment with the number of draws."""
SCENARIO = "three-cylinders"
MAX_TAKES = 20
"""Number of reads after which a launcher is ended, as by a signal."""
STILL = 1e-6
"""Motion of an arm that counts as none [m]."""
CHECK = (sys.executable, "-S", "-c", "")
"""Command that finds every scenario in order."""
READY_AND_IDLE = Program("idle", "tests.benchmarks.faults.idle_process", ready_line="ready")
"""Process that the launcher runs."""
Target = tuple[st.SearchStrategy[Any], Callable[[Any], int]]
"""Strategy of the draws, and function that gives one and returns how many messages passed."""


def fuzzed(open_target: AbstractContextManager[Target], count: int) -> int:
    """Give draws to a target; return how many messages passed the check of the bus."""
    passed, given_count = 0, 0
    # Refusals are what is asked for, not news.
    logging.disable(logging.ERROR)
    try:
        with open_target as (strategy, give):

            @DRAWING(max_examples=count, derandomize=COUNT not in os.environ)
            @given(strategy)
            def attempt(drawn: object) -> None:
                nonlocal passed, given_count
                passed += give(drawn)
                given_count += 1

            attempt()
    finally:
        logging.disable(logging.NOTSET)
    assert given_count >= count
    return passed


@contextmanager
def service(name: str) -> Iterator[Target]:
    """Service that takes hostile messages among those of an ordinary run."""
    cell = load(SCENARIO)
    # Arms that only a person arms: none may move.
    ends = {side: replace(cell.end(side), arm_automatically=False) for side in SIDES}
    cell = replace(cell, ends=replace(cell.ends, **ends))
    with ExitStack() as cleanup:
        address = ""
        if name == "dashboard":
            member = build_dashboard(cell, "dashboard-0", DashboardOptions(port=free_port()))
            address = member.address
        else:
            member = services.build(name, cell, f"{name}-0")
        # A fault behind the door is one that the door hides.
        if door := getattr(member, "door", None):
            door.strict = True
        cleanup.callback(getattr(member, "close", lambda: None))
        member.warm_up()
        pages = OpenPages(address, 1) if address else None
        if pages:
            cleanup.callback(pages.close)
        step = _Stepping(member, ordinary_run(SCENARIO))

        def give(messages: Messages) -> int:
            accepted = step(messages)
            _check_gateway(member, cell)
            assert pages is None or not pages.closed, f"the page has ended {pages.reason}"
            return accepted

        topics = TOPICS if hasattr(member, "tap") else tuple(member.reads)
        yield hostile(topics, SCENARIO), give


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
def launcher() -> Iterator[Target]:
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
            first = find(SCENARIO)
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

    yield hostile((HEALTH, TASK_STATE, ARM_STATE, STACK_REQUEST), SCENARIO), give


@contextmanager
def bus() -> Iterator[Target]:
    """Subscriptions of a real bus to all topics, one by one and all at once."""
    hub, namespace = f"tcp/127.0.0.1:{free_port()}", f"fuzz-{secrets.token_hex(4)}"
    with ExitStack() as cleanup:
        options = BusOptions(namespace, connect=(), listen=(hub,))
        reader = cleanup.enter_context(buses.open(options, "reader"))
        everything = reader.subscribe_all()
        subscriptions = [reader.subscribe(topic) for topic in TOPICS]
        session = cleanup.enter_context(open_session(hub, namespace))

        def give(example: tuple[Messages, Any]) -> int:
            messages, rng = example
            for _, raw in messages:
                own = PROTOBUF_ENCODING + raw.type
                put(session, rng, raw, rng.choice((own, own, "text/plain", "")))
            for subscription in subscriptions:
                subscription.take()
            return len(list(everything.take()))

        yield st.tuples(hostile(TOPICS, SCENARIO), st.randoms(use_true_random=False)), give


TARGETS: dict[str, tuple[Callable[[], AbstractContextManager[Target]], int]] = {
    "robot_gateway": (partial(service, "robot_gateway"), 150),
    "controller": (partial(service, "controller"), 40),
    "recorder": (partial(service, "recorder"), 60),
    "dashboard": (partial(service, "dashboard"), 60),
    "launcher": (launcher, 10),
    "bus": (bus, 40),
}
MORE = ("planner", "perception", "sim")
"""Services beside them, with `FUZZ_COUNT` alone."""
if COUNT in os.environ:
    TARGETS |= {name: (partial(service, name), 0) for name in MORE}


@pytest.mark.parametrize("name", TARGETS)
def test_a_process_survives_hostile_messages(name: str) -> None:
    open_target, few = TARGETS[name]
    count = int(os.environ.get(COUNT, few))
    assert fuzzed(open_target(), count) > count / 4


def test_a_service_that_raises_is_reported(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(step: _Stepping, messages: Messages) -> int:
        raise KeyError("found")

    monkeypatch.setattr(_Stepping, "__call__", fail)
    with pytest.raises(KeyError, match="found"):
        fuzzed(service("robot_gateway"), 20)


def test_an_arm_that_moves_is_a_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys.modules[__name__], "STILL", -1.0)
    with pytest.raises(AssertionError, match=r"an arm moved by 0.000 mm"):
        fuzzed(service("robot_gateway"), 5)

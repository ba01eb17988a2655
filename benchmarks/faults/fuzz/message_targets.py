"""Services under hostile messages, stepped in this process behind the check of the bus."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.faults.fuzz.hostile_messages import HostileMessages
from lariat.scenario import SIDES, Scenario
from lariat.trajectory import SECOND
from shared.bus.message_check import MessageCheck
from shared.runtime.service import Mailbox, Received, Service
from shared.topics import TOPICS, Topic
from stack import services
from stack.simulation.simulated_time import START, Delivery

NAMES = ("robot_gateway", "controller", "planner", "perception", "sim", "recorder")
"""Services that are fuzzed."""
MESSAGES_PER_STEP = 16
"""Hostile messages between two steps of a service."""
PLACEHOLDERS = ("overhead", "sim", "controller", "x")
"""Names that fill the placeholder of a topic."""


@dataclass
class Totals:
    """Counts of one target."""

    messages: int = 0
    """Hostile messages."""
    accepted: int = 0
    """Messages that the check passed on to the service."""
    steps: int = 0
    """Steps of the service."""
    memory_mb: float = 0.0
    """Largest memory of the campaign's process after a batch [MB]."""
    failures: list[str] = field(default_factory=list)
    """Exceptions and broken rules, each with the batch that reproduces it."""


def corpus_of(lawful: Sequence[Delivery]) -> dict[str, list[bytes]]:
    """Return the payloads of messages by topic key."""
    corpus: dict[str, list[bytes]] = {}
    for delivery in lawful:
        corpus.setdefault(delivery.key, []).append(delivery.payload)
    return corpus


def disarmed(scenario: Scenario) -> Scenario:
    """Return the scenario with arms that only a person arms."""
    ends = {side: replace(scenario.end(side), arm_automatically=False) for side in SIDES}
    return replace(scenario, ends=replace(scenario.ends, **ends))


class ServiceTarget:
    """One service that takes hostile messages among the recorded ones of an ordinary run."""

    def __init__(self, name: str, scenario: Scenario, lawful: Sequence[Delivery]) -> None:
        """Build the service.

        Args:
            name: One of `NAMES`.
            scenario: The cell.
            lawful: Messages of an ordinary run, some of which the service gets as well.
        """
        self._name = name
        self._scenario = disarmed(scenario)
        self._lawful = lawful
        self._corpus = corpus_of(lawful)
        self._check = MessageCheck()
        self._now = START
        self._next = 0
        self._build()

    def _build(self) -> None:
        self._service = self._create(self._scenario)
        self._service.warm_up()
        self._tap = getattr(self._service, "tap", None)
        self._mailbox = Mailbox(self._service.reads)

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Send hostile messages to the service, and step it."""
        source = HostileMessages(seed, self._corpus)
        topics = tuple(self._service.reads) if not self._tap else TOPICS
        try:
            for k in range(count):
                self._send(source, topics[k % len(topics)], totals)
                if k % MESSAGES_PER_STEP == MESSAGES_PER_STEP - 1:
                    self._send_lawful()
                    self._step(totals)
        except Exception:
            totals.failures.append(f"{self._name} {seed}: {traceback.format_exc(limit=-4)}")
            self._build()
        if broken := self._broken_rule():
            totals.failures.append(f"{self._name} {seed}: {broken}")
            self._build()

    def close(self) -> None:
        """Close the service."""
        if close := getattr(self._service, "close", None):
            close()

    def _create(self, scenario: Scenario) -> Service:
        """Return a new service, after the former one has failed."""
        return services.build(self._name, scenario, f"{self._name}-0")

    def _send(self, source: HostileMessages, topic: Topic, totals: Totals) -> None:
        if "{" in topic.key:
            topic = topic.at(PLACEHOLDERS[totals.messages % len(PLACEHOLDERS)])
        raw = source.draw(topic, self._now)
        totals.messages += 1
        message = self._check.decode(topic, raw)
        if message is None:
            return
        totals.accepted += 1
        if self._tap:
            self._tap(raw)
        else:
            self._mailbox.deliver(
                raw.key, Received(message, raw.publisher, raw.sequence, raw.received)
            )

    def _send_lawful(self) -> None:
        """Pass on the next message of the ordinary run that the service reads."""
        keys = {topic.key for topic in self._service.reads}
        for _ in range(len(self._lawful)):
            delivery = self._lawful[self._next % len(self._lawful)]
            self._next += 1
            if delivery.key in keys:
                received = Received(
                    delivery.parse(), delivery.publisher, delivery.sequence, self._now
                )
                self._mailbox.deliver(delivery.key, received)
                return

    def _step(self, totals: Totals) -> None:
        self._now += round(SECOND / self._service.rate)
        for topic, message in self._service.step(self._mailbox.take(), self._now):
            message.SerializeToString()
            assert topic.matches(topic.key)
        totals.steps += 1

    def _broken_rule(self) -> str:
        """Return which promise the gateway broke; empty if none."""
        cell = getattr(self._service, "cell", None)
        if cell is None:
            return ""
        named = {o.name for o in cell.follower.constraints.collision.scene.obstacles}
        missing = {body.name for body in self._scenario.bodies} - named
        if missing:
            return f"{sorted(missing)} vanished from the scene"
        for side, grip, start in zip(
            SIDES, cell.arms.grips, self._scenario.grips(self._scenario.start), strict=True
        ):
            moved = float(np.linalg.norm(grip.position - start.position))
            if not moved < 1e-6:
                return f"the {side} arm moved by {1e3 * moved:.3f} mm"
        return ""

"""Doors of a real bus under hostile messages: types, versions and attachments that are made up."""

from __future__ import annotations

import random
import secrets
import socket
import time
import traceback
from contextlib import ExitStack

from benchmarks.faults.fuzz.hostile_messages import HostileMessages
from benchmarks.faults.fuzz.hostile_publisher import (
    ENCODING,
    Options,
    hostile_attachment,
    open_session,
)
from benchmarks.faults.fuzz.message_targets import PLACEHOLDERS, Totals
from shared import bus as buses
from shared.bus import BusOptions
from shared.topics import TOPICS

ARRIVAL_TIMEOUT = 2.0
"""Longest wait for the messages of a batch [s]; a bus may drop some."""
POLL_PERIOD = 0.005
"""Time between two looks for messages [s]."""


class BusTarget:
    """Subscriptions to all topics, one by one and all at once; a failure is an exception."""

    def __init__(self) -> None:
        """Open a bus of its own on a free port of 127.0.0.1."""
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            hub = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
        namespace = f"fuzz-{secrets.token_hex(4)}"
        self._open = ExitStack()
        bus = self._open.enter_context(
            buses.open(BusOptions(namespace, connect=(), listen=(hub,)), "reader")
        )
        self._everything = bus.subscribe_all()
        self._subscriptions = [bus.subscribe(topic) for topic in TOPICS]
        self._session = self._open.enter_context(open_session(Options(hub, namespace)))

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Publish hostile messages, and take them."""
        rng, source = random.Random(seed), HostileMessages(seed, {})
        for k in range(count):
            topic = TOPICS[k % len(TOPICS)]
            if "{" in topic.key:
                topic = topic.at(rng.choice(PLACEHOLDERS))
            raw = source.draw(topic, 0)
            self._session.put(
                raw.key,
                raw.payload,
                encoding=rng.choice((ENCODING + raw.type, ENCODING + raw.type, "text/plain", "")),
                attachment=hostile_attachment(rng, raw),
            )
        totals.messages += count
        deadline = time.monotonic() + ARRIVAL_TIMEOUT
        before = self._everything.refused + totals.accepted
        arrived = 0
        try:
            while arrived < count and time.monotonic() < deadline:
                totals.accepted += sum(1 for _ in self._everything.take())
                for subscription in self._subscriptions:
                    subscription.take()
                arrived = self._everything.refused + totals.accepted - before
                totals.steps += 1
                time.sleep(POLL_PERIOD)
        except Exception:
            totals.failures.append(f"bus {seed}: {traceback.format_exc(limit=-4)}")

    def close(self) -> None:
        """Leave the bus."""
        self._open.close()

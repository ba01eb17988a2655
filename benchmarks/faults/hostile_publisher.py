"""Publisher of hostile messages on a real bus, with attachments that no process of ours sends.

It joins below `shared.bus`, which lets nobody write an attachment of their own.
"""

from __future__ import annotations

import random
import time
from collections.abc import Sequence

import zenoh
from hypothesis import given, seed

from benchmarks.faults.hostile_messages import DRAWING, Messages, hostile
from shared.bus import BusOptions
from shared.bus.configuration import zenoh_configuration
from shared.bus.message_check import PROTOBUF_ENCODING, MessageCheck, RawMessage
from shared.topics import STACK_REQUEST, TASK_REQUEST, TOPICS
from stack.credentials.local_secret import find_local_secret

DRAWS = 500
"""Number of draws of hypothesis, of up to 16 messages each."""
BURST_PERIOD = 0.01
"""Time between two bursts [s]."""


def drawn() -> list[tuple[RawMessage, bool]]:
    """Return messages over all topics, and whether each may be changed further.

    Some are valid, but no request for a run or another scenario: those are a person's.
    """
    pool: list[tuple[RawMessage, bool]] = []
    check = MessageCheck()

    @seed(0)
    @DRAWING(max_examples=DRAWS)
    @given(hostile(TOPICS, "three-cylinders"))
    def collect(messages: Messages) -> None:
        for topic, raw in messages:
            free = topic not in (TASK_REQUEST, STACK_REQUEST)
            if free or check.decode(topic, raw) is None:
                pool.append((raw, free and bool(raw.payload)))

    collect()
    return pool


def publish(
    pool: Sequence[tuple[RawMessage, bool]], hub: str, namespace: str, rate: float, count: int
) -> None:
    """Publish messages, as `drawn` returns them, at a rate [Hz]; half of the free ones changed."""
    rng = random.Random(0)
    with open_session(hub, namespace) as session:
        begun, sent = time.monotonic(), 0
        while sent < count:
            while sent < min((time.monotonic() - begun) * rate, count):
                raw, free = rng.choice(pool)
                if free and rng.random() < 0.5:
                    content = bytearray(raw.payload)
                    content[rng.randrange(len(content))] = rng.randrange(256)
                    raw = raw._replace(payload=bytes(content))
                put(session, rng, raw, PROTOBUF_ENCODING + raw.type)
                sent += 1
            time.sleep(BURST_PERIOD)


def open_session(hub: str, namespace: str) -> zenoh.Session:
    """Join the bus, with the secret of this user's stack."""
    options = BusOptions(namespace, (hub,), (), "client", find_local_secret((hub,)))
    return zenoh.open(zenoh_configuration(options, None))


def put(session: zenoh.Session, rng: random.Random, raw: RawMessage, encoding: str) -> None:
    """Publish a message, some with an attachment that no process sends."""
    attachment = f"{raw.sequence} {raw.publisher} {raw.version}".encode()
    if rng.random() > 0.7:
        others = (b"", b" ", rng.randbytes(40), b"9" * 5000 + b" p 1", b"\xff\xff 1", b"-1 p -1")
        attachment = rng.choice(others)
    session.put(raw.key, raw.payload, encoding=encoding, attachment=attachment)

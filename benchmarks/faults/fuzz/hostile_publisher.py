"""Publisher of hostile messages on a real bus, with attachments that no process of ours sends.

    python -m benchmarks.faults.fuzz.hostile_publisher --hub ENDPOINT --namespace NAME [--settings
    FILE]

It joins below `shared.bus`, which lets nobody write an attachment of their own. It sends what the
check of the bus refuses, over all topics: a lawful run goes on beside it.
"""

from __future__ import annotations

import json
import logging
import random
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import tyro
import zenoh

from benchmarks.faults.fuzz.hostile_messages import HostileMessages
from benchmarks.faults.fuzz.message_targets import PLACEHOLDERS
from shared.bus.message_check import MessageCheck, RawMessage
from shared.topics import TOPICS

ENCODING = "application/protobuf;"
"""Encoding of a message, before the full name of its type."""
POOL_SIZE = 4000
"""Number of different messages, which are made before the first is sent."""
BURST_PERIOD = 0.01
"""Time between two bursts [s]."""


@dataclass(frozen=True)
class Options:
    """Options of the publisher."""

    hub: str
    """Zenoh endpoint of the bus."""
    namespace: str
    """Name of the cell."""
    settings: Path | None = None
    """JSON file of further Zenoh settings."""
    rate: float = 1000.0
    """Messages in a second [Hz]."""
    duration: float = 600.0
    """Time after which it ends [s]."""
    seed: int = 0
    """Seed of all choices."""


def refused_messages(seed: str, count: int) -> Iterator[RawMessage]:
    """Yield messages over all topics that the check of the bus refuses."""
    source, check = HostileMessages(seed, {}), MessageCheck()
    made = k = 0
    while made < count:
        topic = TOPICS[k % len(TOPICS)]
        k += 1
        if "{" in topic.key:
            topic = topic.at(PLACEHOLDERS[k % len(PLACEHOLDERS)])
        raw = source.draw(topic, 0)
        if check.decode(topic, raw) is None:
            made += 1
            yield raw


def hostile_attachment(rng: random.Random, raw: RawMessage) -> bytes:
    """Return the attachment of a message, or one that no process sends."""
    lawful = f"{raw.sequence} {raw.publisher} {raw.version}".encode()
    hostile = (b"", b" ", rng.randbytes(40), b"9" * 5000 + b" p 1", b"\xff\xff 1", b"-1 p -1")
    return lawful if rng.random() < 0.7 else rng.choice(hostile)


def open_session(options: Options) -> zenoh.Session:
    """Join the bus."""
    settings: dict[str, object] = {
        "mode": "client",
        "namespace": options.namespace,
        "connect/endpoints": [options.hub],
        "scouting/multicast/enabled": False,
        # Ended by a signal, it would leave a file in /dev/shm.
        "transport/shared_memory/enabled": False,
    }
    if options.settings:
        settings |= json.loads(options.settings.read_text(encoding="utf-8"))
    config = zenoh.Config()
    for key, value in settings.items():
        config.insert_json5(key, json.dumps(value))
    return zenoh.open(config)


def publish(session: zenoh.Session, options: Options) -> int:
    """Publish at the wanted rate until the time is over; return the number of messages."""
    rng = random.Random(options.seed)
    pool = [
        (raw.key, raw.payload, ENCODING + raw.type, hostile_attachment(rng, raw))
        for raw in refused_messages(str(options.seed), POOL_SIZE)
    ]
    print("ready", flush=True)
    begun, sent = time.monotonic(), 0
    while (elapsed := time.monotonic() - begun) < options.duration:
        while sent < elapsed * options.rate:
            key, payload, encoding, attachment = pool[sent % len(pool)]
            session.put(key, payload, encoding=encoding, attachment=attachment)
            sent += 1
        time.sleep(BURST_PERIOD)
    return sent


def main() -> None:
    """Publish hostile messages, and print their number."""
    options = tyro.cli(Options)
    logging.disable(logging.WARNING)
    with open_session(options) as session:
        print(publish(session, options))


if __name__ == "__main__":
    sys.exit(main())

"""Publisher of hostile messages on a real bus, with attachments that no process of ours sends.

    python -m benchmarks.faults.hostile_publisher --hub ENDPOINT --namespace NAME [--settings FILE]

It joins below `shared.bus`, which lets nobody write an attachment of their own. It sends what the
check of the bus refuses, over all topics: a lawful run goes on beside it. With `--count` half of
the messages are those of an ordinary run, of publishers that do not run here.
"""

from __future__ import annotations

import json
import logging
import random
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import tyro
import zenoh

from shared.bus.message_check import MessageCheck, RawMessage
from shared.topics import TOPICS
from shared.version import MESSAGE_VERSION
from stack.credentials.local_secret import find_local_secret
from stack.launcher import module_entry

ENCODING = "application/protobuf;"
"""Encoding of a message, before the full name of its type."""
PLACEHOLDERS = ("overhead", "sim", "controller", "x")
"""Names that fill the placeholder of a topic."""
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
    seed: int = 0
    """Seed of all choices."""
    count: int | None = None
    """Number of messages after which it ends; None: never."""


@contextmanager
def hostile_publisher(
    hub: str, namespace: str, rate: float, *more: str
) -> Iterator[subprocess.Popen[bytes]]:
    """Publish hostile messages on the bus of a stack, in a process of its own."""
    options = ["--hub", hub, "--namespace", namespace, "--rate", str(rate), *more]
    if secret := find_local_secret((hub,)):
        options += ["--settings", str(secret)]
    command = module_entry.command("benchmarks.faults.hostile_publisher", *options)
    publisher = subprocess.Popen([sys.executable, *command], stdout=subprocess.DEVNULL)
    try:
        yield publisher
    finally:
        publisher.terminate()
        publisher.wait()


def refused_messages(rng: random.Random, count: int) -> Iterator[RawMessage]:
    """Yield messages over all topics that the check of the bus refuses."""
    check, made = MessageCheck(), 0
    while made < count:
        topic = rng.choice(TOPICS)
        if "{" in topic.key:
            topic = topic.at(rng.choice(PLACEHOLDERS))
        own, other = (t.type.DESCRIPTOR.full_name for t in (topic, rng.choice(TOPICS)))
        raw = RawMessage(
            key=topic.key,
            type=rng.choice((own, own, other, "", "lariat.Nothing")),
            payload=rng.randbytes(rng.choice((0, 1, 8, 64, 1000))),
            publisher=rng.choice(("stranger", "controller-0", "sim-0", "")),
            sequence=rng.choice((0, 1, 10**17)),
            received=0,
            version=rng.choice((MESSAGE_VERSION, MESSAGE_VERSION, 0, 99)),
        )
        if check.decode(topic, raw) is None:
            made += 1
            yield raw


def _ordinary_messages(rng: random.Random, count: int) -> list[RawMessage]:
    """Messages of all topics of an ordinary run, in the names of processes that do not run."""
    # The simulation is not imported where nobody asks for it.
    from benchmarks.faults.fuzz.targets import ordinary_run

    deliveries = ordinary_run("three-cylinders")
    return [
        RawMessage(d.key, d.topic.type.DESCRIPTOR.full_name, d.payload, "stranger", k, 0)
        for k, d in enumerate(rng.choices(deliveries, k=count))
    ]


def lawful_attachment(raw: RawMessage) -> bytes:
    """Return the attachment of a message."""
    return f"{raw.sequence} {raw.publisher} {raw.version}".encode()


def hostile_attachment(rng: random.Random, raw: RawMessage) -> bytes:
    """Return the attachment of a message, or one that no process sends."""
    lawful = lawful_attachment(raw)
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


def main() -> None:
    """Publish hostile messages at the wanted rate until the process is ended."""
    options = tyro.cli(Options)
    logging.disable(logging.WARNING)
    rng = random.Random(options.seed)
    pool = [(raw, hostile_attachment(rng, raw)) for raw in refused_messages(rng, POOL_SIZE)]
    if options.count is not None:
        pool += [(raw, lawful_attachment(raw)) for raw in _ordinary_messages(rng, POOL_SIZE)]
        rng.shuffle(pool)
    with open_session(options) as session:
        begun, sent = time.monotonic(), 0
        while options.count is None or sent < options.count:
            while sent < (time.monotonic() - begun) * options.rate:
                raw, attachment = pool[sent % len(pool)]
                encoding = ENCODING + raw.type
                session.put(raw.key, raw.payload, encoding=encoding, attachment=attachment)
                sent += 1
            time.sleep(BURST_PERIOD)


if __name__ == "__main__":
    main()

"""Hostile program in ROS 2's graph: `python -m benchmarks.faults.hostile_node ROUTER ATTACK`.

It prints a 1 for each message that it has received, or answer that it has got.
"""

from __future__ import annotations

import json
import os
import random
import sys
import time
from collections.abc import Iterator

import zenoh
from zenoh.handlers import Callback

SUBSCRIBERS, SLOWNESS = 10, 0.1
"""Number of slow subscribers to all topics, and time that each takes for a message [s]."""
RATE = 2000
"""Calls or queries in a second [Hz]."""
MAX_SIZE = 2000
"""Size of the largest garbage [bytes]."""
TIMEOUT = 5.0
"""Longest wait for an answer [s]."""
TOKENS = "@ros2_lv/**"
"""Key of all liveliness tokens."""


def joined(router: str) -> zenoh.Session:
    """Return a session of a router."""
    config = zenoh.Config()
    config.insert_json5("mode", '"client"')
    config.insert_json5("connect/endpoints", json.dumps([router]))
    return zenoh.open(config)


def note(_: object) -> None:
    """Note what has arrived."""
    # One call: several threads write.
    os.write(1, b"1\n")


NOTE = Callback(note, indirect=False)
"""The same, in Zenoh's own threads; a thread for each query would take the cores."""


def subscribe_slowly(router: str) -> None:
    """Subscribe to everything, many times, and take long for each message."""

    def slow(sample: zenoh.Sample) -> None:
        note(sample)
        time.sleep(SLOWNESS)

    sessions = [joined(router) for _ in range(SUBSCRIBERS)]
    subscribers = [session.declare_subscriber("**", slow) for session in sessions]
    while subscribers:
        time.sleep(1.0)


def call_with_garbage(router: str) -> None:
    """Call all services, those of actions too, with garbage."""
    session = joined(router)
    keys = list(services(session))
    for k in paced():
        attachment = random.randbytes(k % 40)
        if k % 2:
            # As rmw_zenoh has it, so that the garbage is decoded.
            attachment = random.randbytes(16) + b"\x10" + random.randbytes(16)
        payload = b"\x00\x01\x00\x00" + random.randbytes(random.randrange(MAX_SIZE))
        session.get(
            keys[k % len(keys)], NOTE, payload=payload, attachment=attachment, timeout=TIMEOUT
        )


def query(router: str) -> None:
    """Ask for everything, kept messages and the graph included."""
    session = joined(router)
    for k in paced():
        if k % 2:
            session.get("**", NOTE, timeout=TIMEOUT)
        else:
            session.liveliness().get(TOKENS, NOTE, timeout=TIMEOUT)


def services(session: zenoh.Session) -> Iterator[str]:
    """Yield the keys of all services that have a token."""
    for reply in session.liveliness().get(TOKENS):
        if reply.ok is not None and "/SS/" in (token := str(reply.ok.key_expr)):
            domain, name, kind, hash = (token.split("/")[k] for k in (1, -4, -3, -2))
            yield f"{domain}/{name.strip('%').replace('%', '/')}/{kind}/{hash}"


def paced() -> Iterator[int]:
    """Yield numbers at the rate."""
    begun, k = time.monotonic(), 0
    while True:
        yield k
        k += 1
        time.sleep(max(0.0, begun + k / RATE - time.monotonic()))


ATTACKS = {"subscribers": subscribe_slowly, "calls": call_with_garbage, "queries": query}
"""Attacks by name."""

if __name__ == "__main__":
    # What it computes itself is no attack.
    os.nice(19)
    ATTACKS[sys.argv[2]](sys.argv[1])

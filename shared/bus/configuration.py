"""Configuration of Zenoh for the bus of a cell."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import zenoh

from shared.bus.options import BusError, BusOptions, check_namespace, key_expression, reason_of
from shared.topics import MAX_IMAGE_SIZE, TOPICS

HEADER_SIZE = 4096
"""Room for attachment and headers around the largest message of a topic [bytes]."""
FROZEN_LEASE_MS = 2000
"""Time without a sign of life after which a peer counts as gone [ms]."""
SEND_QUEUE_SIZE = 16
"""Batches that wait for the network thread, per priority: the most that Zenoh allows."""
ONE_SIDE_CONNECTS = {"peer": {"to_router": "always", "to_peer": "greater-zid"}}
"""Strategy by which one of two peers that hear of each other connects, the one with the greater id.

Where both connect at once, each may close the other's link, and neither tries again."""
PENDING_CONNECTIONS = 8192
"""Most connections that have not said who they are: a crowd of them keeps nobody from joining."""
SECRET_SETTINGS = ("transport/auth", "transport/link/tls")
"""First part of the settings whose values are secret."""


def zenoh_configuration(options: BusOptions, timeout: float | None) -> zenoh.Config:
    """Return the configuration of a process.

    Args:
        options: Endpoints and settings.
        timeout: Longest wait for an answer at `options.connect` [s]; None does not wait.

    Raises:
        BusError: A setting is wrong.
    """
    check_namespace(options.namespace)
    settings: dict[str, Any] = {
        "mode": options.mode,
        "namespace": options.namespace,
        "connect/endpoints": options.connect,
        "listen/endpoints": options.listen,
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": True,
        "scouting/gossip/autoconnect_strategy": ONE_SIDE_CONNECTS,
        # /dev/shm belongs to all users of the machine: one that fills it would keep processes out.
        "transport/shared_memory/enabled": False,
        "transport/link/tx/lease": FROZEN_LEASE_MS,
        "transport/unicast/accept_pending": PENDING_CONNECTIONS,
        "transport/link/rx/max_message_size": MAX_IMAGE_SIZE + HEADER_SIZE,
        "low_pass_filter": _size_filters(options.namespace),
    }
    if timeout is not None:
        settings["connect/timeout_ms"] = int(1e3 * timeout)
        settings["connect/exit_on_failure"] = True
    # The queues must hold what is sent while the network thread waits for a core.
    for priority in ("real_time", "data", "data_low"):
        settings[f"transport/link/tx/queue/size/{priority}"] = SEND_QUEUE_SIZE
    if options.settings:
        settings.update(_read_settings(options.settings))
    config = zenoh.Config()
    for key, value in settings.items():
        try:
            config.insert_json5(key, json.dumps(value))
        except zenoh.ZError as error:
            # A private key or a password must not get into a log.
            shown = "…" if key.startswith(SECRET_SETTINGS) else json.dumps(value)
            raise BusError(f"Zenoh refuses {key} = {shown}: {reason_of(error)}") from None
    return config


def _size_filters(namespace: str) -> list[dict[str, Any]]:
    """Filters that drop what is larger than a message of its topic before it waits unread."""
    return [
        {
            "id": topic.key,
            "messages": ["put"],
            "flows": ["ingress"],
            "key_exprs": [f"{namespace}/{key_expression(topic.key)}"],
            "size_limit": topic.max_size + HEADER_SIZE,
        }
        for topic in TOPICS
    ]


def _read_settings(path: Path) -> dict[str, Any]:
    try:
        table = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BusError(f"cannot read bus settings {path}: {error}") from None
    if not isinstance(table, dict):
        raise BusError(f"bus settings {path} must be a JSON object of settings by their path")
    return table

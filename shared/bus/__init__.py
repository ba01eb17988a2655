"""The bus: publishers and subscriptions of topics, over Zenoh. Only this package imports zenoh.

Peers on loopback find each other by gossip through the hub in the launcher, without multicast.
Every message carries its protobuf type in the encoding; its sequence number, its publisher, the
version of the message set and the time of sending in the attachment. Messages of a newer version
are refused.

Unread messages wait in bounded ring buffers, and a publisher never waits for a reader, except for
up to 50 ms when one stops reading images. A message that a slow reader loses is missing from the
sequence numbers, and counted. A message larger than its topic allows is dropped where it arrives.
"""

from __future__ import annotations

from shared.bus.message_check import RawMessage
from shared.bus.options import (
    DEFAULT_HUB,
    BusError,
    BusOptions,
    Unreachable,
    check_namespace,
    key_expression,
)
from shared.bus.publisher import Publisher
from shared.bus.session import Bus, open
from shared.bus.subscription import MAX_KEYS, RawSubscription, Subscription

__all__ = [
    "DEFAULT_HUB",
    "MAX_KEYS",
    "Bus",
    "BusError",
    "BusOptions",
    "Publisher",
    "RawMessage",
    "RawSubscription",
    "Subscription",
    "Unreachable",
    "check_namespace",
    "key_expression",
    "open",
]

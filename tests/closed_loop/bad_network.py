"""Networks that lose, double and delay messages, and services whose clocks differ."""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from lariat.trajectory import SECOND
from shared.messages import Message
from shared.runtime.service import Inbox, Publication, Received, Service
from shared.topics import Topic
from stack.simulation.simulated_time import Delivery

MILLISECOND, HOUR = SECOND // 1000, 3600 * SECOND
CUT = range(4 * SECOND, 5 * SECOND)
"""Simulated time in which a cut network passes nothing [ns]; the arms move then."""

CONDITIONS: dict[str, Callable[[random.Random, Delivery], tuple[int, ...]]] = {
    "lost-1": lambda rng, _: () if rng.random() < 0.01 else (0,),
    "lost-10": lambda rng, _: () if rng.random() < 0.1 else (0,),
    "lost-50": lambda rng, _: () if rng.random() < 0.5 else (0,),
    "doubled": lambda rng, _: (0, rng.randrange(30 * MILLISECOND)) if rng.random() < 0.3 else (0,),
    "delayed-20": lambda rng, _: (20 * MILLISECOND,),
    "delayed-100": lambda rng, _: (100 * MILLISECOND,),
    "reordered-20": lambda rng, _: (rng.randrange(20 * MILLISECOND),),
    "reordered-80": lambda rng, _: (rng.randrange(80 * MILLISECOND),),
    "cut": lambda _, delivery: () if delivery.received in CUT else (0,),
}
"""Delays of a message's copies [ns] by the network's name: percent of the messages, or [ms]."""
CLOCK_OFFSETS: dict[str, dict[str, int]] = {
    "clock-controller": {"controller": HOUR},
    "clock-gateway": {"robot_gateway": HOUR},
    "clock-planner": {"planner": HOUR},
    "clock-perception": {"perception": HOUR},
    "clock-camera-20ms": {"sim": 20 * MILLISECOND},
    "clock-camera-ahead": {"sim": HOUR},
    "clock-camera-behind": {"sim": -HOUR},
}
"""By how much the clocks of which services are ahead of all others [ns], by name.

A process reads the wall clock once, at its start, so that a clock that is set while a cell runs is
seen as such an offset between processes that started before and after.
"""


class OffsetService:
    """Service on a machine whose clock is ahead of simulated time."""

    def __init__(self, service: Service, offset: int) -> None:
        """Args: service: The service. offset: By how much its clock is ahead [ns]."""
        self._service = service
        self._offset = offset
        self.name, self.rate, self.latency = service.name, service.rate, service.latency
        self.reads, self.writes = service.reads, service.writes

    def warm_up(self) -> None:
        """Warm the service up."""
        self._service.warm_up()

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Step the service at the time of its own clock."""
        newest = {t.key: self._later(item) for t in self.reads if (item := inbox.latest(t))}
        arrived = {t.key: [self._later(item) for item in inbox.every(t)] for t in self.reads}
        for topic, message in self._service.step(Inbox(newest, arrived), now + self._offset):
            yield Publication(topic, self._stamped(topic, message))

    def _later(self, item: Received) -> Received:
        return item._replace(received=item.received + self._offset)

    def _stamped(self, topic: Topic, message: Message) -> Message:
        """Return a message with the camera's stamp by its own clock.

        The simulated camera exposes at the gateway's times; a real one has but its own.
        """
        if not topic.key.startswith("camera/"):
            return message
        copy: Any = type(message)()
        copy.CopyFrom(message)
        copy.timestamp.FromNanoseconds(copy.timestamp.ToNanoseconds() + self._offset)
        return copy


def with_clock_offsets(members: Sequence[Service], offsets: dict[str, int]) -> tuple[Service, ...]:
    """Return services of which some have a clock of their own.

    Args:
        members: The services.
        offsets: By how much the clocks of which services are ahead, by name [ns].
    """
    return tuple(
        OffsetService(service, offsets[service.name]) if service.name in offsets else service
        for service in members
    )

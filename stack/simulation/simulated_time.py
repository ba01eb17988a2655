"""Runner of services in one process in simulated time, deterministic and without waiting.

Every service is stepped at its own rate, in integer nanoseconds and in a fixed order. Its outputs
are delivered after its declared latency. Messages are passed as bytes: no object is shared, and a
recording holds exactly the services' inputs.
"""

from __future__ import annotations

import heapq
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from lariat.trajectory import SECOND
from shared import topics
from shared.messages import Message, Trace
from shared.runtime.service import Inbox, Mailbox, Received, Service
from shared.topics import Topic

START = SECOND
"""Start of simulated time [ns]; not 0, because a stamp of 0 means that there is none."""


@dataclass(frozen=True)
class Delivery:
    """Serialised message with its origin and time of delivery."""

    topic: Topic
    """Topic with a concrete key."""
    payload: bytes
    """Serialised message."""
    publisher: str
    """Id of the process start that sent it."""
    sequence: int
    """Number among the publisher's messages on this topic, from 0."""
    received: int
    """Time of delivery [ns]."""
    published: int = 0
    """Time of the step that sent it [ns]."""

    @property
    def key(self) -> str:
        """Key of its topic."""
        return self.topic.key

    def parse(self) -> Any:
        """Return the decoded message, a new object in each call."""
        return self.topic.type.FromString(self.payload)


Tap = Callable[[Delivery], None]
"""Function that is called with every message, in the order of delivery."""


Network = Callable[[Delivery], Sequence[int]]
"""Function from a message to the delays of its copies beside the declared latency [ns]: none where
it is lost, several where it is doubled."""


@dataclass
class _ScheduledService:
    """Service with its schedule and its mailbox."""

    service: Service
    start: int
    rate: Fraction
    latency: int
    mailbox: Mailbox
    publisher: str
    trace: Topic
    steps: int = 0
    step_ms: list[float] = field(default_factory=list)

    @property
    def due(self) -> int:
        """Time of the next step [ns], without accumulated rounding errors."""
        return self.start + self.steps * SECOND * self.rate.denominator // self.rate.numerator


class SimulatedStack:
    """Services of a cell, connected in memory."""

    def __init__(
        self,
        services: Sequence[Service],
        taps: Sequence[Tap] = (),
        start: int = START,
        network: Network = lambda _: (0,),
    ) -> None:
        """Connect services.

        Args:
            services: Services; those due at the same time are stepped in this order.
            taps: Functions that are called with every message.
            start: Time of the first step [ns].
            network: Faults of the network; by default none.
        """
        self.now = start
        """Present time [ns]."""
        self.taps = list(taps)
        """Functions that are called with every message."""
        self._scheduled = [_schedule(service, start) for service in services]
        self._readers: dict[str, list[_ScheduledService]] = defaultdict(list)
        for entry in self._scheduled:
            for topic in entry.service.reads:
                self._readers[topic.key].append(entry)
        self._pending: list[tuple[int, int, Delivery]] = []
        self._published = 0
        self._network = network
        self._sequences: dict[tuple[str, str], int] = defaultdict(int)
        self._newest: dict[str, Delivery] = {}

    def warm_up(self) -> None:
        """Compile and allocate what the first steps need."""
        for entry in self._scheduled:
            entry.service.warm_up()

    def send(self, topic: Topic, message: Message, publisher: str = "lariat") -> None:
        """Publish a message that is no service's; it is delivered without latency.

        Raises:
            TypeError: The message is not of the topic's type.
        """
        self._publish(topic, message, publisher, self.now)

    def latest(self, topic: Topic) -> Any | None:
        """Return the newest delivered message of a topic; None before the first."""
        delivery = self._newest.get(topic.key)
        return delivery.parse() if delivery else None

    def step_ms(self, service: str) -> list[float]:
        """Return the wall times of all steps of one service [ms]."""
        (entry,) = [s for s in self._scheduled if s.service.name == service]
        return entry.step_ms

    def advance(self) -> int:
        """Take all steps that are due next, and return their time [ns]."""
        self.now = min(entry.due for entry in self._scheduled)
        for entry in self._scheduled:
            if entry.due == self.now:
                self._deliver()
                self._step(entry)
        return self.now

    def advance_to(self, instant: int) -> None:
        """Take all steps before an instant [ns], and set the present time to it."""
        while min(entry.due for entry in self._scheduled) < instant:
            self.advance()
        self.now = max(self.now, instant)
        self._deliver()

    def _step(self, entry: _ScheduledService) -> None:
        inbox = entry.mailbox.take()
        began = time.perf_counter()
        # A step is an iterator: it is exhausted before any of its output is delivered.
        publications = list(entry.service.step(inbox, self.now))
        entry.step_ms.append(1e3 * (time.perf_counter() - began))
        for topic, message in publications:
            self._publish(topic, message, entry.publisher, self.now + entry.latency)
        self._publish(entry.trace, _trace(entry, inbox, self.now), entry.publisher, self.now)
        entry.steps += 1

    def _publish(self, topic: Topic, message: Message, publisher: str, delivery_time: int) -> None:
        if not isinstance(message, topic.type):
            raise TypeError(
                f"{publisher} published a {type(message).__name__} on {topic.key}, "
                f"which takes {topic.type.__name__}"
            )
        sequence = self._sequences[publisher, topic.key]
        self._sequences[publisher, topic.key] += 1
        payload = message.SerializeToString(deterministic=True)
        delivery = Delivery(topic, payload, publisher, sequence, delivery_time, self.now)
        for delay in self._network(delivery):
            late = replace(delivery, received=delivery_time + delay) if delay else delivery
            heapq.heappush(self._pending, (late.received, self._published, late))
            self._published += 1

    def _deliver(self) -> None:
        while self._pending and self._pending[0][0] <= self.now:
            delivery = heapq.heappop(self._pending)[2]
            self._newest[delivery.key] = delivery
            for entry in self._readers[delivery.key]:
                # A service does not receive its own messages.
                if entry.publisher != delivery.publisher:
                    received = Received(
                        delivery.parse(), delivery.publisher, delivery.sequence, delivery.received
                    )
                    entry.mailbox.deliver(delivery.key, received)
            for tap in self.taps:
                tap(delivery)


def _schedule(service: Service, start: int) -> _ScheduledService:
    if door := getattr(service, "door", None):
        door.strict = True
    return _ScheduledService(
        service,
        start=start,
        rate=Fraction(service.rate).limit_denominator(1000),
        latency=round(service.latency * SECOND),
        mailbox=Mailbox(service.reads),
        publisher=session_id(service.name),
        trace=topics.TRACE.at(service.name),
    )


def session_id(service: str) -> str:
    """Return the id of a service's only start in simulated time."""
    return f"{service}-0"


def _trace(entry: _ScheduledService, inbox: Inbox, now: int) -> Trace:
    return Trace(service=entry.service.name, step=entry.steps, now=now, inputs=inbox.consumed)

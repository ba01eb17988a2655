"""Steps services in one process on simulated time: deterministic, as fast as they run.

Every service is stepped at its own rate on integer nanoseconds, in a fixed order. What it publishes
becomes visible its declared latency after the step that took the inputs. Messages cross as bytes,
so that nobody shares an object and a recording holds what the services saw.
"""

from __future__ import annotations

import heapq
import time
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from shared import topics
from shared.messages import Message, Trace
from shared.service import SECOND, Inbox, Mailbox, Received, Service
from shared.topics import Topic

START = SECOND
"""Simulated time begins here [ns]; a stamp of 0 means that there is none."""


@dataclass(frozen=True)
class Delivery:
    """One message, as bytes, with what the bus says of it."""

    topic: Topic
    payload: bytes
    publisher: str
    """Id of the process start that sent it."""
    sequence: int
    """Its number among the publisher's messages on this topic, from 0."""
    received: int
    """When it becomes visible [ns]."""

    @property
    def key(self) -> str:
        """Of its topic."""
        return self.topic.key

    def parse(self) -> Any:
        """The message, as an object of one's own."""
        return self.topic.type.FromString(self.payload)


Tap = Callable[[Delivery], None]
"""Sees every message, traces among them, in the order in which they become visible."""


@dataclass
class _Seat:
    """One service and when it is stepped."""

    service: Service
    start: int
    rate: Fraction
    latency: int
    mailbox: Mailbox
    publisher: str
    steps: int = 0
    step_ms: list[float] = field(default_factory=list)

    @property
    def due(self) -> int:
        """Instant of the next step [ns], without accumulating a rounding error."""
        return self.start + self.steps * SECOND * self.rate.denominator // self.rate.numerator


class SimulatedStack:
    """A cell's services, joined in memory."""

    def __init__(
        self, services: Sequence[Service], taps: Sequence[Tap] = (), start: int = START
    ) -> None:
        """Joins the services.

        Args:
            services: In the order in which those due at the same instant are stepped.
            taps: See every message.
            start: First instant [ns].
        """
        self.now = start
        """Instant of the steps taken last [ns]."""
        self.taps = list(taps)
        self._seats = [_seat(service, start) for service in services]
        self._readers: dict[str, list[Mailbox]] = defaultdict(list)
        for seat in self._seats:
            for topic in seat.service.reads:
                self._readers[topic.key].append(seat.mailbox)
        self._pending: list[tuple[int, int, Delivery]] = []
        self._published = 0
        self._sequences: dict[tuple[str, str], int] = defaultdict(int)
        self._newest: dict[str, Delivery] = {}

    def warm_up(self) -> None:
        """Compiles and allocates what the first steps would otherwise wait for."""
        for seat in self._seats:
            seat.service.warm_up()

    def send(self, topic: Topic, message: Message, publisher: str = "lariat") -> None:
        """Publishes from outside; visible at once."""
        self._publish(topic, message, publisher, self.now)

    def latest(self, topic: Topic) -> Any | None:
        """The newest visible message of a topic; None before the first."""
        delivery = self._newest.get(topic.key)
        return delivery.parse() if delivery else None

    def step_ms(self, service: str) -> list[float]:
        """Wall time of every step of one service so far [ms]."""
        (seat,) = [s for s in self._seats if s.service.name == service]
        return seat.step_ms

    def advance(self) -> int:
        """Takes all steps of the next instant at which one is due, and returns it [ns]."""
        self.now = min(seat.due for seat in self._seats)
        for seat in self._seats:
            if seat.due == self.now:
                self._deliver()
                self._step(seat)
        return self.now

    def advance_to(self, instant: int) -> None:
        """Takes all steps before an instant [ns], which becomes the present."""
        while min(seat.due for seat in self._seats) < instant:
            self.advance()
        self.now = max(self.now, instant)
        self._deliver()

    def _step(self, seat: _Seat) -> None:
        inbox = seat.mailbox.take()
        began = time.perf_counter()
        # A step is an iterator: it is run to its end before anything of it is visible.
        publications = list(seat.service.step(inbox, self.now))
        seat.step_ms.append(1e3 * (time.perf_counter() - began))
        for topic, message in publications:
            self._publish(topic, message, seat.publisher, self.now + seat.latency)
        trace = _trace(seat, inbox, self.now)
        self._publish(topics.TRACE.at(seat.service.name), trace, seat.publisher, self.now)
        seat.steps += 1

    def _publish(self, topic: Topic, message: Message, publisher: str, visible: int) -> None:
        if not isinstance(message, topic.type):
            raise TypeError(
                f"{publisher} published a {type(message).__name__} on {topic.key}, "
                f"which takes {topic.type.__name__}"
            )
        sequence = self._sequences[publisher, topic.key]
        self._sequences[publisher, topic.key] += 1
        payload = message.SerializeToString(deterministic=True)
        delivery = Delivery(topic, payload, publisher, sequence, visible)
        heapq.heappush(self._pending, (visible, self._published, delivery))
        self._published += 1

    def _deliver(self) -> None:
        while self._pending and self._pending[0][0] <= self.now:
            delivery = heapq.heappop(self._pending)[2]
            self._newest[delivery.key] = delivery
            for mailbox in self._readers[delivery.key]:
                mailbox.deliver(
                    delivery.key,
                    Received(
                        delivery.parse(), delivery.publisher, delivery.sequence, delivery.received
                    ),
                )
            for tap in self.taps:
                tap(delivery)


def _seat(service: Service, start: int) -> _Seat:
    return _Seat(
        service,
        start=start,
        rate=Fraction(service.rate).limit_denominator(1000),
        latency=round(service.latency * SECOND),
        mailbox=Mailbox(service.reads),
        publisher=session(service.name),
    )


def session(service: str) -> str:
    """Id of a service's only start in simulated time."""
    return f"{service}-0"


def _trace(seat: _Seat, inbox: Inbox, now: int) -> Trace:
    return Trace(service=seat.service.name, step=seat.steps, now=now, inputs=inbox.consumed)

"""Connection of a process to the bus."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import zenoh

from shared.bus.configuration import zenoh_configuration
from shared.bus.lingering import close_at_once
from shared.bus.message_check import RawMessage
from shared.bus.options import BusError, BusOptions, Unreachable, reason_of
from shared.bus.publisher import Publisher
from shared.bus.subscription import RawSubscription, Subscription
from shared.runtime.clock import Clock, SystemClock
from shared.topics import Topic

ALL_CAPACITY = 2048
"""Number of unread messages of all topics that are kept: seconds of a cell, with its images about
100 MB."""


@contextmanager
def open(
    options: BusOptions, publisher: str, clock: Clock | None = None, timeout: float | None = None
) -> Iterator[Bus]:
    """Join the bus for the duration of a `with` block.

    Args:
        options: Endpoints and settings.
        publisher: Id of this start of the process, which every message carries.
        clock: Clock of the times of receipt; by default the system's.
        timeout: Longest wait for an answer at `options.connect` [s]; None does not wait: peers are
            connected whenever they appear.

    Raises:
        Unreachable: No process answered in time.
        BusError: An endpoint is taken or a setting is wrong.
    """
    try:
        session = zenoh.open(zenoh_configuration(options, timeout))
    except zenoh.ZError as error:
        raise _bus_error(options, error) from None
    # An open session with subscribers keeps the interpreter from exiting.
    try:
        close_at_once(session)
        yield Bus(session, publisher, clock or SystemClock())
    finally:
        session.close()


class Bus:
    """Connection of one process to the bus; `open` creates it."""

    def __init__(self, session: zenoh.Session, publisher: str, clock: Clock) -> None:
        self._session = session
        self._publisher = publisher
        self._clock = clock
        self._taps: list[deque[RawMessage]] = []
        """Own messages that subscriptions to all topics have not taken yet."""

    def publisher(self, topic: Topic) -> Publisher:
        """Return a publisher of one topic.

        Raises:
            ValueError: The topic's placeholder is not filled.
        """
        if "{" in topic.key:
            raise ValueError(f"topic {topic.key!r} has a placeholder; fill it with topic.at(name)")
        return Publisher(self._session, topic, self._publisher, self._clock, self._taps)

    def subscribe(
        self, topic: Topic, own: bool = True, arrived: Callable[[], object] | None = None
    ) -> Subscription:
        """Return a subscription to the future messages of one topic."""
        return Subscription(self._session, topic, self._clock, own, arrived)

    def subscribe_all(self) -> RawSubscription:
        """Return a subscription to the future messages of all topics."""
        self._taps.append(deque(maxlen=ALL_CAPACITY))
        return RawSubscription(self._session, self._clock, ALL_CAPACITY, self._taps[-1])

    def declare_alive(self, service: str) -> None:
        """List this process in `alive` for as long as it is connected."""
        # The token dies with its last reference.
        self._token = self._session.liveliness().declare_token(f"alive/{service}")

    def alive(self, timeout: float = 0.5) -> set[str]:
        """Return the names of the connected services; a frozen one is dropped after 2 s.

        Args:
            timeout: Longest wait for answers [s].
        """
        replies = self._session.liveliness().get("alive/*", timeout=timeout)
        return {str(r.ok.key_expr).removeprefix("alive/") for r in replies if r.ok is not None}


def _bus_error(options: BusOptions, error: Exception) -> BusError:
    """Error in the user's terms, from one of Zenoh."""
    text = str(error)
    connect = ", ".join(options.connect)
    if "already in use" in text:
        return BusError(f"{', '.join(options.listen)} is taken; is another stack running there?")
    if "nable to connect" in text:
        hint = " (credentials that it refuses look the same)" if options.settings else ""
        return Unreachable(f"no stack answers at {connect}{hint}; is `lariat up` running?")
    return BusError(f"cannot join the bus at {connect}: {reason_of(error)}")

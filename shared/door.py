"""Door of a process: what others send is handled, or refused with a reason, and the process lives.

Every message, request and file of others is handled inside of a door. The process' own state is
not: an exception there ends the process, which its log shows.
"""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from lariat.configuration import reason_of

log = logging.getLogger(__name__)

Item = TypeVar("Item")
Value = TypeVar("Value")

MAX_LOGGED_LENGTH = 200
"""Number of characters after which the reason of a refusal is cut in the log."""
MAX_SOURCES = 256
"""Most sources whose refusals are counted one by one: names can be made up, and each takes lines of
the log."""
OTHERS = "others"
"""Source of all beyond."""


class Guard:
    """`with` block in which one thing is handled: `Door.guard` creates it."""

    def __init__(self, door: Door, source: str) -> None:
        self.refusal = ""
        """Why it is refused; empty if it is not."""
        self._door, self._source = door, source

    def __enter__(self) -> Guard:
        """Begin."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: object
    ) -> bool | None:
        """Turn an exception into a refusal."""
        if not isinstance(error, Exception):
            return False
        expected = isinstance(error, ValueError | OSError)
        if self._door.strict and not expected:
            return False
        self.refusal = reason_of(error)
        self._door.refuse(self._source, self.refusal, None if expected else error)
        return True


class Door:
    """Guard of the handling of others' messages, requests and files, with the count of refusals."""

    def __init__(self) -> None:
        self.strict = False
        """Whether an exception that is neither a `ValueError` nor an `OSError` is raised: a fault
        of the program, which must not stay unseen where nobody attacks, as in simulated time."""
        self.refused = 0
        """Number of refusals."""
        self._counts: dict[str, int] = {}

    def guard(self, source: str) -> Guard:
        """Turn any exception of a `with` block into a refusal; the value has its reason afterwards.

        Args:
            source: What is handled, for the log, e.g. `scene/request`.
        """
        return Guard(self, source)

    def converted(
        self, source: str, items: Iterable[Item], convert: Callable[[Item], Value]
    ) -> Iterator[Value]:
        """Yield what a conversion makes of things; one of which it makes nothing is refused.

        Only the conversion is guarded, not what is done with a value.
        """
        for item in items:
            with self.guard(source):
                yield convert(item)

    def refuse(self, source: str, reason: str, fault: Exception | None = None) -> None:
        """Count a refusal, and log it at counts of 1, 10, 100, … of its source.

        Args:
            source: What is refused, and whose it is.
            reason: Why.
            fault: Exception that nobody expected, whose traceback belongs in the log.
        """
        self.refused += 1
        if source not in self._counts and len(self._counts) >= MAX_SOURCES:
            source = OTHERS
        count = self._counts[source] = self._counts.get(source, 0) + 1
        # The log must stay readable.
        if count == 10 ** (len(str(count)) - 1):
            text = reason[:MAX_LOGGED_LENGTH]
            log.warning("refused %s: %s (%d so far)", source, text, count, exc_info=fault)

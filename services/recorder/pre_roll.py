"""Queue of messages between the bus and the files: pre-roll of an idle cell, backlog of a run."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator

from shared.bus import RawMessage


class PreRoll:
    """The newest messages, in order of arrival."""

    def __init__(self) -> None:
        self._messages: deque[RawMessage] = deque()
        self.size = 0
        """Size of the payloads [bytes]."""

    def put(self, message: RawMessage) -> None:
        """Append a message."""
        self._messages.append(message)
        self.size += len(message.payload)

    @property
    def start(self) -> int | None:
        """Time of the oldest message [ns]; None without messages."""
        return self._messages[0].received if self._messages else None

    def take_older(self, time: int, max_size: int) -> Iterator[RawMessage]:
        """Remove and yield the messages before a time, and the oldest beyond a size [bytes]."""
        while self._messages and (self._messages[0].received < time or self.size > max_size):
            yield self._take()

    def take_states(self, before: int, max_size: int) -> Iterator[RawMessage]:
        """Remove and yield the oldest messages before a time [ns] that are no images.

        It stops once their payloads exceed a size [bytes].
        """
        waiting, self._messages = self._messages, deque()
        for message in waiting:
            if message.topic.large or message.received >= before or max_size <= 0:
                self._messages.append(message)
                continue
            self.size -= len(message.payload)
            max_size -= len(message.payload)
            yield message

    def take_oldest(self, max_size: float) -> Iterator[RawMessage]:
        """Remove and yield the oldest messages, until their payloads exceed a size [bytes]."""
        while self._messages and max_size > 0:
            message = self._take()
            max_size -= len(message.payload)
            yield message

    def _take(self) -> RawMessage:
        message = self._messages.popleft()
        self.size -= len(message.payload)
        return message

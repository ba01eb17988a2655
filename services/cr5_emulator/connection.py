"""Connection of a client to the emulated arm, as two buffers of bytes."""

from __future__ import annotations

from collections import deque

from services.cr5_emulator.command_parser import Call, CommandParser

UNREAD_SEGMENT_LIMIT = 250
"""Segments that are kept for a client that does not read."""


class Connection:
    """Connection of one client to one port."""

    def __init__(self, port: int, now: float) -> None:
        self.port = port
        self.closed = False
        self.last_received = now
        """Time of the client's last bytes [s]."""
        self.reader = CommandParser()
        self.waiting: deque[Call] = deque()
        """Calls received but not handled, as those behind a Sync."""
        self._segments: deque[bytes] = deque()
        self._inbox = bytearray()

    def feed(self, data: bytes) -> None:
        """Take bytes from the client."""
        self._inbox += data

    def take(self) -> bytes | None:
        """Return the next segment for the client; None when there is none."""
        return self._segments.popleft() if self._segments else None

    @property
    def unread(self) -> bool:
        """Whether segments wait for the client."""
        return bool(self._segments)

    def close(self) -> None:
        """Mark the connection as closed, by either side."""
        self.closed = True

    def received(self) -> bytes:
        """Return the bytes from the client since the last call."""
        data, self._inbox = bytes(self._inbox), bytearray()
        return data

    def write(self, segment: bytes) -> None:
        """Queue a segment for the client."""
        self._segments.append(segment)
        # For a client that does not read the oldest packets are dropped, or memory would fill.
        while len(self._segments) > UNREAD_SEGMENT_LIMIT:
            self._segments.popleft()

"""Link to an arm: byte streams to its ports, which never block.

`tcp_link.TcpLink` reaches a device over TCP. In simulated time the caller hands in a link to an
emulated arm in memory.
"""

from __future__ import annotations

from typing import Literal, Protocol

StreamState = Literal["opening", "open", "closed"]


class ByteStream(Protocol):
    """One connection to one port."""

    @property
    def state(self) -> StreamState:
        """Whether the connection is being made, stands, or has ended."""
        ...

    @property
    def reason(self) -> str:
        """Why the stream is closed, in words."""
        ...

    def send(self, data: bytes) -> None:
        """Send bytes; on a stream that is not open they are lost."""
        ...

    def receive(self) -> bytes:
        """Return the bytes that have arrived since the last call."""
        ...

    def close(self) -> None:
        """Close the stream in an orderly way."""
        ...

    def abort(self) -> None:
        """Close the stream at once and discard what has been sent but not delivered."""
        ...


class Link(Protocol):
    """Access to the ports of one device."""

    @property
    def live(self) -> bool:
        """Whether the device runs on its own clock, not on that of `advance`."""
        ...

    def open(self, port: int) -> ByteStream:
        """Begin to connect to a port of the device."""
        ...

    def advance(self, now: int) -> None:
        """State the time of the current step [ns]; a simulated device is stepped up to it."""
        ...

    def guard(self, stream: ByteStream | None, commands: tuple[str, str], moving: bool) -> None:
        """Report a step to who stops the device when steps cease; a simulated one needs nobody.

        Commands: the one that stops the device, and the one that takes its power.
        """
        ...

    def close(self) -> None:
        """End the guard, in an orderly way."""
        ...

"""Byte streams to a device, which never block: over TCP, or in memory to an emulated arm."""

from __future__ import annotations

import contextlib
import errno
import os
import socket
import struct
import time
from typing import Literal, Protocol

from services.cr5_emulator.core import Connection, Emulator
from shared.configuration import ConfigurationError

State = Literal["opening", "open", "closed"]

TOO_LATE = 50_000_000
"""Age of a step from which what it sends is thrown away [ns]."""


class Link(Protocol):
    """One connection."""

    @property
    def state(self) -> State:
        """Whether it is there yet, still or no more."""
        ...

    @property
    def reason(self) -> str:
        """Why it is closed, in words."""
        ...

    def send(self, data: bytes) -> None:
        """Hands bytes over; on a link that is not open they are lost."""
        ...

    def receive(self) -> bytes:
        """What has come in since the last call."""
        ...

    def close(self) -> None:
        """Ends it in an orderly way."""
        ...

    def abort(self) -> None:
        """Ends it at once; what was sent and has not arrived is thrown away."""
        ...


class Network(Protocol):
    """Where a device is."""

    def open(self, port: int) -> Link:
        """Begins to connect to one of its ports."""
        ...

    def advance(self, now: int) -> None:
        """Lets what is simulated catch up with the present [ns]."""
        ...


class TcpNetwork:
    """A device at an address.

    A process can be stopped in the middle of a step, and goes on where it was. It must not say then
    what it meant before: what is sent long after the step's own time is thrown away.
    """

    def __init__(self, host: str) -> None:
        """
        Args:
            host: Its address, or a name that is looked up once, now: nobody may wait for an answer
                while arms move.

        Raises:
            ConfigurationError: The name is not known.
        """
        try:
            (_, _, _, _, place), *_ = socket.getaddrinfo(host, None, socket.AF_INET)
        except OSError as error:
            raise ConfigurationError(
                f"address = {host!r} of an arm is not known here ({error}); write its IP address, "
                "without a port"
            ) from error
        self._host = str(place[0])
        self._now: int | None = None
        self._least = 0

    def open(self, port: int) -> Link:
        return TcpLink(self._host, port, self)

    def advance(self, now: int) -> None:
        # Both clocks run alike; the least that ever lay between them is how far they are apart.
        apart = time.monotonic_ns() - now
        self._least = apart if self._now is None else min(self._least, apart)
        self._now = now

    @property
    def late(self) -> bool:
        """Whether the step that is being made began too long ago to be told of."""
        begun = self._now
        return begun is not None and time.monotonic_ns() - begun - self._least > TOO_LATE


class TcpLink:
    """One non-blocking socket."""

    def __init__(self, host: str, port: int, network: TcpNetwork) -> None:
        self._network = network
        self._place = f"{host}:{port}"
        self._state: State = "opening"
        self._reason = ""
        self._unsent = b""
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self._socket.setblocking(False)
        self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        code = self._socket.connect_ex((host, port))
        if code not in (0, errno.EINPROGRESS):
            self._fail(os.strerror(code).lower())

    @property
    def state(self) -> State:
        if self._state == "opening":
            self._check()
        return self._state

    @property
    def reason(self) -> str:
        return self._reason

    def send(self, data: bytes) -> None:
        if self.state != "open" or self._network.late:
            return
        self._unsent += data
        try:
            sent = self._socket.send(self._unsent)
            self._unsent = self._unsent[sent:]
        except BlockingIOError:
            if len(self._unsent) > 65536:
                self._fail("it takes no more bytes")
        except OSError as error:
            self._fail((error.strerror or str(error)).lower())

    def receive(self) -> bytes:
        if self.state != "open":
            return b""
        parts = []
        try:
            while len(parts) < 64:
                data = self._socket.recv(65536)
                if not data:
                    self._fail("closed by the other side")
                    break
                parts.append(data)
        except BlockingIOError:
            pass
        except OSError as error:
            self._fail((error.strerror or str(error)).lower())
        return b"".join(parts)

    def close(self) -> None:
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)
        self._socket.close()
        self._state = "closed"

    def abort(self) -> None:
        if self._state != "closed":
            # Without lingering the system answers everything with a reset and forgets its buffer.
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            self._socket.close()
        self._state = "closed"

    def _check(self) -> None:
        try:
            self._socket.getpeername()
            self._state = "open"
        except OSError:
            code = self._socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if code:
                self._fail(os.strerror(code).lower())

    def _fail(self, reason: str) -> None:
        self._reason = f"{self._place}: {reason}"
        self._state = "closed"
        self._socket.close()


class MemoryNetwork:
    """An emulated arm in this process, on the caller's clock."""

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator

    def open(self, port: int) -> Link:
        return MemoryLink(self.emulator.connect(port), port)

    def advance(self, now: int) -> None:
        self.emulator.advance_to(now * 1e-9)


class MemoryLink:
    """One connection to an emulated arm."""

    def __init__(self, connection: Connection | None, port: int) -> None:
        self._connection, self._port = connection, port

    @property
    def state(self) -> State:
        return "closed" if self._connection is None or self._connection.closed else "open"

    @property
    def reason(self) -> str:
        return f"emulator:{self._port}: refused or closed"

    def send(self, data: bytes) -> None:
        if self._connection is not None:
            self._connection.feed(data)

    def receive(self) -> bytes:
        parts = []
        while self._connection is not None and (segment := self._connection.take()) is not None:
            parts.append(segment)
        return b"".join(parts)

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()

    def abort(self) -> None:
        self.close()

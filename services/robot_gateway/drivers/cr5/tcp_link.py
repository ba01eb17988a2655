"""Link to a device over TCP, with non-blocking sockets."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import os
import socket
import struct
import time

from lariat.configuration import ConfigurationError
from services.robot_gateway.drivers.cr5.link import ByteStream, StreamState
from services.robot_gateway.stop_guard.stop_guard import StopGuard

SEND_DEADLINE = 50_000_000
"""Age of a step above which nothing is sent any more [ns]."""
SEND_BUFFER_LIMIT = 65536
"""Bytes that may wait to be sent before the stream counts as broken."""
READ_SIZE = 65536
"""Largest read from a socket [bytes]."""
READS_PER_STEP = 64
"""Largest number of reads from one socket in one step."""
UNSPECIFIED_ADDRESS = bytes(16)
"""Socket address of family AF_UNSPEC: connecting to it dissolves a connection, connect(2)."""


class TcpLink:
    """Link to the ports of a device at an address.

    The operating system may suspend the process in the middle of a step and resume it later. A
    command computed before the suspension is outdated by then: it is dropped, not sent.
    """

    live = True

    def __init__(self, host: str) -> None:
        """Resolve the address.

        A name is resolved once, here: no look-up may block while arms move.
        """
        try:
            (_, _, _, _, address), *_ = socket.getaddrinfo(host, None, socket.AF_INET)
        except OSError as error:
            raise ConfigurationError(
                f"address = {host!r} of an arm cannot be resolved ({error}); write its IP address, "
                "without a port"
            ) from error
        self._host = str(address[0])
        self._now: int | None = None
        self._clock_offset = 0
        self._guard = StopGuard()

    def open(self, port: int) -> ByteStream:
        return TcpStream(self._host, port, self)

    def advance(self, now: int) -> None:
        # Both clocks run at the same rate; the least difference seen is their offset.
        offset = time.monotonic_ns() - now
        self._clock_offset = offset if self._now is None else min(self._clock_offset, offset)
        self._now = now

    def guard(self, stream: ByteStream | None, commands: tuple[str, str], moving: bool) -> None:
        connection = stream.socket if isinstance(stream, TcpStream) else None
        self._guard.report(connection, commands, moving)

    def close(self) -> None:
        self._guard.close()

    @property
    def overdue(self) -> bool:
        """Whether the current step began too long ago for its commands to be sent."""
        begun = self._now
        if begun is None:
            return False
        return time.monotonic_ns() - begun - self._clock_offset > SEND_DEADLINE


class TcpStream:
    """Byte stream over one non-blocking socket."""

    def __init__(self, host: str, port: int, link: TcpLink) -> None:
        self._link = link
        self._address = f"{host}:{port}"
        self._state: StreamState = "opening"
        self._reason = ""
        self._unsent = b""
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        self.socket.setblocking(False)
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        code = self.socket.connect_ex((host, port))
        if code not in (0, errno.EINPROGRESS):
            self._fail(os.strerror(code).lower())

    @property
    def state(self) -> StreamState:
        if self._state == "opening":
            self._check_connected()
        return self._state

    @property
    def reason(self) -> str:
        return self._reason

    def send(self, data: bytes) -> None:
        if self.state != "open" or self._link.overdue:
            return
        self._unsent += data
        try:
            sent = self.socket.send(self._unsent)
            self._unsent = self._unsent[sent:]
        except BlockingIOError:
            if len(self._unsent) > SEND_BUFFER_LIMIT:
                self._fail("the device reads no more bytes")
        except OSError as error:
            self._fail((error.strerror or str(error)).lower())

    def receive(self) -> bytes:
        if self.state != "open":
            return b""
        parts = []
        try:
            while len(parts) < READS_PER_STEP:
                data = self.socket.recv(READ_SIZE)
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
            self.socket.shutdown(socket.SHUT_RDWR)
        self.socket.close()
        self._state = "closed"

    def abort(self) -> None:
        if self._state != "closed":
            # With a linger time of zero, the end of the connection sends a reset and discards the
            # send buffer. It must end here, though the guard holds a copy of the socket.
            self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            ctypes.CDLL(None).connect(
                self.socket.fileno(), UNSPECIFIED_ADDRESS, len(UNSPECIFIED_ADDRESS)
            )
            self.socket.close()
        self._state = "closed"

    def _check_connected(self) -> None:
        try:
            self.socket.getpeername()
            self._state = "open"
        except OSError:
            code = self.socket.getsockopt(socket.SOL_SOCKET, socket.SO_ERROR)
            if code:
                self._fail(os.strerror(code).lower())

    def _fail(self, reason: str) -> None:
        self._reason = f"{self._address}: {reason}"
        self._state = "closed"
        self.socket.close()

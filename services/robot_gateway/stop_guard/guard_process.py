"""Process that stops an arm when the gateway has died or hangs.

    python -I -S guard_process.py CHANNEL

It holds a copy of the gateway's connection to the arm, which outlives the gateway: an arm may
accept a single client. The gateway reports at every tick over a socket pair, whose end tells its
death at once. It imports next to nothing, so that it starts soon, stays small and has little that
can fail.
"""

from __future__ import annotations

import contextlib
import os
import select
import socket
import sys
import time
from collections.abc import Sequence

REPORT_TIMEOUT = 0.1
"""Time without a report after which a moving arm is stopped [s]; an arm must begin to brake within
150 ms of any fault."""
SETTLE_TIME = 0.3
"""Time from the stop until the power is taken of an arm whose gateway has died [s]."""
REPLY_TIME = 0.3
"""Time for which replies are awaited before the connection is closed [s]."""
REPORT_SIZE = 256
"""Largest report [bytes]."""
MOVING, RESTING, DISCONNECTED = b"m", b"r", b"d"
"""Reports of the gateway: the arm moves; it rests; the connection has ended. Any other report comes
with a new connection and states two commands, one a line: the stop, and the one that takes the
power."""


def main() -> None:
    """Guard the arm whose gateway is at the other end of the channel on the command line."""
    guard(socket.socket(fileno=int(sys.argv[1])))


def guard(channel: socket.socket) -> None:
    """Stop the arm whenever reports cease, until the gateway ends."""
    connection: int | None = None
    stop = take_power = b""
    watched = False
    while True:
        # A last look precedes the time-out: reports that came while this process slept count.
        if watched and not select.select([channel], [], [], REPORT_TIMEOUT)[0]:
            _send(connection, stop)
            watched = False
        report, handles, _, _ = socket.recv_fds(channel, REPORT_SIZE, 1)
        if not report:
            break
        if handles or report == DISCONNECTED:
            _close(connection)
            connection = None
        if handles:
            connection = handles[0]
            stop, take_power = report.split(b"\n")
        watched = report == MOVING and connection is not None
    if connection is not None:
        _send(connection, stop)
        time.sleep(SETTLE_TIME)
        _send(connection, take_power)
        _await_replies(connection, (stop, take_power))
        _close(connection)


def _send(connection: int | None, command: bytes) -> None:
    """Send a command; on a connection that has ended it is lost."""
    if connection is not None:
        with contextlib.suppress(OSError):
            os.write(connection, command)


def _await_replies(connection: int, commands: Sequence[bytes]) -> None:
    """Read until the commands are answered: closing with unread replies resets a connection."""
    answers = b""
    deadline = time.monotonic() + REPLY_TIME
    while not all(command in answers for command in commands):
        rest = deadline - time.monotonic()
        if rest <= 0.0 or not select.select([connection], [], [], rest)[0]:
            return
        with contextlib.suppress(OSError):
            if not (data := os.read(connection, 65536)):
                return
            answers += data


def _close(connection: int | None) -> None:
    if connection is not None:
        os.close(connection)


if __name__ == "__main__":
    main()

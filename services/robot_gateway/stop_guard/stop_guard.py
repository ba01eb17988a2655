"""The gateway's side of the guard: starts its process, hands it the connection, reports to it."""

from __future__ import annotations

import contextlib
import logging
import socket
import subprocess
import sys
import time
from pathlib import Path

from services.robot_gateway.stop_guard import guard_process
from services.robot_gateway.stop_guard.guard_process import DISCONNECTED, MOVING, RESTING

log = logging.getLogger(__name__)

RESTART_PERIOD = 1.0
"""Least time between two starts of the process [s]."""


class StopGuard:
    """Guard of one arm; its process is started with the first connection.

    One that has died or reads no more is replaced.
    """

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._channel: socket.socket | None = None
        self._guarded: socket.socket | None = None
        """The connection that the process holds a copy of."""
        self._started = -RESTART_PERIOD

    @property
    def pid(self) -> int:
        """Id of the process; 0 while there is none."""
        return self._process.pid if self._process else 0

    def report(
        self, connection: socket.socket | None, commands: tuple[str, str], moving: bool
    ) -> None:
        """Report one tick, with the commands that stop the arm and that take its power.

        An arm that moves is stopped when reports cease.
        """
        if self._channel is None and (connection is None or not self._start()):
            return
        try:
            assert self._channel is not None
            if connection is None:
                self._channel.send(DISCONNECTED)
            elif connection is not self._guarded:
                words = "\n".join(commands).encode()
                socket.send_fds(self._channel, [words], [connection.fileno()])
            else:
                self._channel.send(MOVING if moving else RESTING)
            self._guarded = connection
        except OSError:
            # It has died, or has read nothing for seconds.
            log.warning("the guard of the arm (process %d) is replaced", self.pid)
            self._end_process()

    def close(self) -> None:
        """End the process; the arm is no longer guarded."""
        if self._channel is not None:
            with contextlib.suppress(OSError):
                self._channel.send(DISCONNECTED)
            self._channel.close()
            self._channel = None
        if self._process is not None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self._process.wait(RESTART_PERIOD)
            self._end_process()

    def _start(self) -> bool:
        """Start the process; False while the last start is too recent."""
        if time.monotonic() - self._started < RESTART_PERIOD:
            return False
        self._started = time.monotonic()
        own, other = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        own.setblocking(False)
        with other:
            handle = other.fileno()
            file = str(Path(guard_process.__file__))
            # A group of its own: what ends the gateway by force must not end its guard.
            self._process = subprocess.Popen(
                [sys.executable, "-I", "-S", file, str(handle)],
                stdin=subprocess.DEVNULL,
                pass_fds=[handle],
                process_group=0,
            )
        self._channel = own
        return True

    def _end_process(self) -> None:
        if self._channel is not None:
            self._channel.close()
        if self._process is not None:
            self._process.kill()
            self._process.wait()
        self._process = self._channel = self._guarded = None

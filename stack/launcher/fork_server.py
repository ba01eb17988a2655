"""Launcher's end of the fork server, which starts processes in a tenth of a second.

Most of the start of a Python process is the import of modules that all processes of the stack
share. The fork server has imported them once (`stack.launcher.fork_server_process`). Where it
cannot run, or fails, there is none, and processes are started as programs of their own.
"""

from __future__ import annotations

import ctypes
import json
import os
import socket
import subprocess
import sys
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict
from typing import IO

from stack.launcher import module_entry
from stack.launcher.fork_server_process import GO, ForkRequest

PROCESS_MODULE = "stack.launcher.fork_server_process"
"""Module of the fork server's own process."""
PR_SET_CHILD_SUBREAPER = 36
"""Option of prctl(2): whether this process adopts descendants whose parent has ended."""
ANSWER_TIMEOUT = 10.0
"""Longest wait for a process [s]; for the first, the fork server imports its modules."""
COMMAND_LINE_SIZE = 2048
"""Room for the command line that a forked process shows [bytes]."""


class ForkedProcess:
    """Child of this process that the fork server has forked; used as `subprocess.Popen` is."""

    def __init__(self, pid: int, output: IO[bytes]) -> None:
        self.pid = pid
        """Process id."""
        self.stdout = output
        """Its standard output and standard error."""
        self._code: int | None = None

    def poll(self) -> int | None:
        """Exit code, minus the signal that ended it; None while it runs."""
        if self._code is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._code = os.waitstatus_to_exitcode(status)
        return self._code


class ForkServer:
    """Fork server, which runs within a `with` block; where there is no Linux, it forks nothing."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        self._environment = environment
        self._server: subprocess.Popen[bytes] | None = None

    def __enter__(self) -> ForkServer:
        """Start it; it imports its modules meanwhile."""
        if sys.platform != "linux":
            return self
        # A socket that keeps messages apart.
        self._channel, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._channel.settimeout(ANSWER_TIMEOUT)
        words = (str(theirs.fileno()), str(os.getpid()), "-" * COMMAND_LINE_SIZE)
        with theirs:
            self._server = subprocess.Popen(
                [sys.executable, *module_entry.command(PROCESS_MODULE, *words)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                pass_fds=(theirs.fileno(),),
                env=self._environment,
                start_new_session=True,
            )
        return self

    def __exit__(self, *error: object) -> None:
        """End the fork server."""
        self._close()

    def fork(self, request: ForkRequest) -> ForkedProcess | None:
        """Fork a process; None if that fails, and then at once for every further one."""
        if self._server is None:
            return None
        control, theirs = socket.socketpair()
        output, their_output = os.pipe()
        try:
            with control, theirs, _adopting():
                control.settimeout(ANSWER_TIMEOUT)
                message = json.dumps(asdict(request)).encode()
                socket.send_fds(self._channel, [message], [theirs.fileno(), their_output])
                theirs.close()
                pid = int(control.recv(64))
                control.send(GO)
        except (OSError, ValueError):
            # Without an answer, or with an empty one, it has ended or hangs.
            os.close(output)
            self._close()
            return None
        finally:
            os.close(their_output)
        return ForkedProcess(pid, open(output, "rb", buffering=0))

    def _close(self) -> None:
        """End the fork server; the processes that it has forked live on."""
        if self._server is not None:
            self._channel.close()
            self._server.kill()
            self._server.wait()
            self._server = None


@contextmanager
def _adopting() -> Iterator[None]:
    """Adopt descendants whose parent ends in a `with` block."""
    set_option = ctypes.CDLL(None).prctl
    set_option(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    try:
        yield
    finally:
        set_option(PR_SET_CHILD_SUBREAPER, 0, 0, 0, 0)

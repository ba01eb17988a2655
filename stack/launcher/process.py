"""Process of the stack: started, its output read, signalled, its end noticed."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from stack.launcher import module_entry
from stack.launcher.fork_server import ForkedProcess, ForkServer
from stack.launcher.fork_server_process import ForkRequest
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT

CHILD_PROCESS = Path(__file__).with_name("child_process.py")
ENVIRONMENT = {**LIBRARY_ENVIRONMENT, "PYTHONUNBUFFERED": "1"}
"""Environment variables that every process gets."""
RESTART_NICENESS = -5
"""Lowest priority at which a process starts that replaces one that died [-]: without the dashboard
there is no HOLD."""
READ_SIZE = 65536
"""Bytes of output read at once."""
READS_AT_ONCE = 16
"""Most reads in a row: a process that prints without end must not keep the launcher busy."""


@dataclass(frozen=True)
class Program:
    """Program that a process runs."""

    name: str
    module: str
    """Dotted name of the module to run, e.g. "services.sim"."""
    arguments: tuple[str, ...] = ()
    """Arguments of the module."""
    restart_arguments: tuple[str, ...] = ()
    """Further arguments when it replaces a process that died."""
    stage: int = 0
    """Stage of the shutdown: stages end in ascending order, each after the one before."""
    niceness: int = 0
    """Scheduling priority, nice(2); below 0 only where the system allows it."""
    ready_line: str = ""
    """Text of the line that it prints when ready; empty: its first health message says so."""
    saves: bool = False
    """Whether it saves data or disconnects browsers while it ends: the launcher waits as long as it
    prints its progress."""
    death_signal: signal.Signals = signal.SIGKILL
    """Signal that the kernel sends it when the launcher is killed."""


@dataclass
class Process:
    """A program and the process that runs it."""

    program: Program
    fork_server: ForkServer | None = None
    """Forks it; none starts a program of its own."""
    state: str = "starting"
    """One of starting, ready, frozen, restarting, dead, stopped."""
    restarts: int = 0
    exit_code: int = 0
    """Exit code of the last death as a shell counts: 128 plus the signal that ended it."""
    deaths: list[float] = field(default_factory=list)
    """Instants of its deaths [s, monotonic]."""
    restart_at: float = 0.0
    """Instant of the next restart [s, monotonic]."""
    last_health: float = 0.0
    """Instant of its last health message [s, monotonic]."""
    last_line: float = 0.0
    """Instant of its last line, or of the signal to end [s, monotonic]."""
    longest_step: float = 0.0
    """Longest step that it declares, during which no health message comes [s]."""
    _popen: subprocess.Popen[bytes] | ForkedProcess | None = None
    _unfinished_line: bytes = b""

    def start(self) -> None:
        """Start the program in a session of its own: Ctrl-C in the terminal must not reach it."""
        program = self.program
        arguments = program.arguments + (program.restart_arguments if self.restarts else ())
        # A whole stack starts at one priority: what is up would keep the rest from starting.
        niceness = min(program.niceness, RESTART_NICENESS) if self.restarts else 0
        request = ForkRequest(program.module, arguments, program.death_signal, niceness)
        forked = self.fork_server.fork(request) if self.fork_server else None
        self._popen = forked or _spawn(request)
        os.set_blocking(self.output.fileno(), False)
        self._unfinished_line = b""
        self.state = "starting"

    def prioritize(self) -> None:
        """Give the process its priority, once it and the whole stack have started."""
        niceness = self.program.niceness
        # Only root may lower a niceness. It leads a group and a session, see `child_process`.
        with suppress(OSError):
            os.setpriority(os.PRIO_PGRP, self.pid, niceness)
        with suppress(OSError):
            Path(f"/proc/{self.pid}/autogroup").write_text(str(niceness))

    @property
    def pid(self) -> int:
        """Process id; 0 before the first start."""
        return self._popen.pid if self._popen else 0

    @property
    def output(self) -> IO[bytes]:
        """Stream of its standard output and standard error."""
        assert self._popen is not None
        assert self._popen.stdout is not None
        return self._popen.stdout

    @property
    def running(self) -> bool:
        """Whether the process exists."""
        return self._popen is not None and self._popen.poll() is None

    def lines(self) -> list[str]:
        """Lines printed since the last call; the last one may be unfinished at the process' end."""
        if self._popen is None or self.output.closed:
            return []
        chunk = None
        for _ in range(READS_AT_ONCE):
            chunk = self.output.read(READ_SIZE)
            if not chunk:
                break
            self._unfinished_line += chunk
        *lines, self._unfinished_line = self._unfinished_line.split(b"\n")
        if chunk == b"" and self._unfinished_line:
            lines.append(self._unfinished_line)
            self._unfinished_line = b""
        return [line.decode(errors="replace").rstrip() for line in lines]

    def poll(self) -> int | None:
        """Exit code as a shell counts; None while the process runs or before its start."""
        if self._popen is None:
            return None
        code = self._popen.poll()
        if code is None:
            return None
        self.exit_code = 128 - code if code < 0 else code
        return self.exit_code

    def close(self) -> None:
        """Close the output of a process that has ended."""
        if self._popen is not None:
            self.output.close()
            self._popen = None

    def send(self, number: signal.Signals) -> None:
        """Send a signal to the process and to all that it started."""
        if self._popen is not None and self._popen.poll() is None:
            os.killpg(self._popen.pid, number)


def _spawn(request: ForkRequest) -> subprocess.Popen[bytes]:
    """Start a process as a program of its own."""
    command = module_entry.command(request.module, *request.arguments)
    return subprocess.Popen(
        child_command(signal.Signals(request.death_signal), request.niceness, command),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        env=process_environment(),
        start_new_session=True,
    )


def process_environment() -> dict[str, str]:
    """Environment variables of a process of the stack."""
    return {**os.environ, **ENVIRONMENT}


def child_command(
    death_signal: signal.Signals, niceness: int, arguments: Sequence[str]
) -> list[str]:
    """Command line of a Python process that ends with this one."""
    entry = [sys.executable, "-I", "-S", str(CHILD_PROCESS)]
    entry += [str(int(death_signal)), str(os.getpid()), str(niceness)]
    return [*entry, sys.executable, *arguments]

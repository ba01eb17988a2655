"""One process of the stack: starting it, reading its lines, ending it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from stack.launcher.library_settings import LIBRARY_SETTINGS

CHILD = Path(__file__).with_name("subprocess_entry.py")
ENVIRONMENT = {**LIBRARY_SETTINGS, "PYTHONUNBUFFERED": "1"}


@dataclass(frozen=True)
class Program:
    """What to start."""

    name: str
    arguments: tuple[str, ...]
    """Of this Python interpreter."""
    restart_arguments: tuple[str, ...] = ()
    """Further ones when it replaces a process that died."""
    stage: int = 0
    """Stages are ended in their order, each after the one before is gone."""
    niceness: int = 0
    ready_line: str = ""
    """What it prints when it is ready; empty: its first health says so."""
    death_signal: signal.Signals = signal.SIGKILL
    """Sent by the kernel when the launcher is killed."""


@dataclass
class Process:
    """A program and the process that runs it now."""

    program: Program
    state: str = "starting"
    """starting, ready, frozen, restarting, dead or stopped"""
    restarts: int = 0
    exit_code: int = 0
    """Of the death before, as a shell counts: 128 and the signal when one ended it."""
    deaths: list[float] = field(default_factory=list)
    """When it died [s, monotonic]."""
    restart_at: float = 0.0
    heard: float = 0.0
    """When its health came last [s, monotonic]."""
    longest_step: float = 0.0
    """What it says a step may last, during which no health comes [s]."""
    _popen: subprocess.Popen[bytes] | None = None
    _rest: bytes = b""

    def start(self) -> None:
        """Starts the program in a session of its own: Ctrl-C in the terminal must not reach it."""
        program = self.program
        shim = [sys.executable, "-I", "-S", str(CHILD), str(int(program.death_signal))]
        shim += [str(os.getpid()), str(program.niceness), sys.executable]
        more = program.restart_arguments if self.restarts else ()
        self._popen = subprocess.Popen(
            [*shim, *program.arguments, *more],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            env={**os.environ, **ENVIRONMENT},
            start_new_session=True,
        )
        os.set_blocking(self.output.fileno(), False)
        self._rest = b""
        self.state = "starting"

    @property
    def pid(self) -> int:
        """0 before the first start."""
        return self._popen.pid if self._popen else 0

    @property
    def output(self) -> IO[bytes]:
        """What it prints."""
        assert self._popen is not None
        assert self._popen.stdout is not None
        return self._popen.stdout

    @property
    def running(self) -> bool:
        return self._popen is not None and self._popen.poll() is None

    def lines(self) -> list[str]:
        """Whole lines printed since the last call; what is left of one when it has ended."""
        if self._popen is None or self.output.closed:
            return []
        # A process that talks without end must not keep the launcher from the others.
        chunk = None
        for _ in range(16):
            chunk = self.output.read(65536)
            if not chunk:
                break
            self._rest += chunk
        *lines, self._rest = self._rest.split(b"\n")
        if chunk == b"" and self._rest:
            lines.append(self._rest)
            self._rest = b""
        return [line.decode(errors="replace").rstrip() for line in lines]

    def ended(self) -> int | None:
        """Its exit code as a shell counts, None while it runs; cleans up after it."""
        if self._popen is None:
            return None
        code = self._popen.poll()
        if code is None:
            return None
        self.exit_code = 128 - code if code < 0 else code
        return self.exit_code

    def forget(self) -> None:
        """Closes what is left of a process that has ended."""
        if self._popen is not None:
            self.output.close()
            self._popen = None

    def send(self, number: signal.Signals) -> None:
        """Sends a signal to the process and all that it started."""
        if self._popen is not None and self._popen.poll() is None:
            os.killpg(self._popen.pid, number)

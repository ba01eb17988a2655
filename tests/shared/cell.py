"""A cell of its own for every test that needs the bus."""

from __future__ import annotations

import secrets
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import ExitStack

from shared import bus as buses
from shared.bus import Bus, BusOptions
from shared.runtime.free_port import free_port
from stack.credentials.local_secret import find_local_secret


def until(condition: Callable[[], object], seconds: float = 10.0) -> None:
    """Waits for a condition."""
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it never came"
        time.sleep(0.005)


class Cell:
    """Joins processes of one cell, all of them in this one."""

    def __init__(self, stack: ExitStack, hub: bool = True) -> None:
        self.port = free_port()
        self.hub = f"tcp/127.0.0.1:{self.port}"
        self.namespace = f"test-{secrets.token_hex(4)}"
        self._stack = stack
        if hub:
            options = BusOptions(self.namespace, connect=(), listen=(self.hub,))
            stack.enter_context(buses.open(options, "hub"))

    def __call__(self, publisher: str) -> Bus:
        # A stack that runs there, if any, admits only who knows its secret.
        secret = find_local_secret((self.hub,))
        options = BusOptions(self.namespace, (self.hub,), settings=secret)
        return self.join(options, publisher)

    def join(self, options: BusOptions, publisher: str) -> Bus:
        """Joins a process with options of its own."""
        return self._stack.enter_context(buses.open(options, publisher))

    def spawn(self, module: str, *arguments: str) -> subprocess.Popen[str]:
        """Starts a module in a process that joins; it ends with the test, whatever fails."""
        process = subprocess.Popen(
            [sys.executable, "-m", module, *self.arguments, *arguments],
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._stack.callback(process.wait)
        self._stack.callback(process.kill)
        return process

    @property
    def arguments(self) -> tuple[str, ...]:
        """Of a process that shall join."""
        return "--connect", self.hub, "--namespace", self.namespace

"""Live cell whose processes are clients of a router, as in containers.

The death of the router cuts each process from all others. In `lariat up` the hub dies with the
launcher and all processes: case `hub-killed`.
"""

from __future__ import annotations

import signal
import subprocess
import time

from benchmarks.faults.cell import LINK_TIMEOUT, FaultCell
from benchmarks.live_stack import free_port
from benchmarks.operator import Operator
from shared.bus import Unreachable
from stack import services
from stack.client import Cell, connect
from stack.launcher import module_entry
from stack.launcher.process import child_command

READY_TIMEOUT = 200.0
"""Longest wait for all processes [s]; kernels may have to be compiled."""
NICENESS = -10
"""Scheduling priority of all processes: the gateway must not be suspended by others."""


class RoutedCell(FaultCell):
    """Live cell whose processes meet at a router, as in containers."""

    def start_stack(self) -> None:
        """Start router and services, and connect to them."""
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.start_router()
        self._open.callback(lambda: self.end(self.router))
        folder = self.emulated.log.parent
        words = ["--scenario", str(self.emulated.cell_scenario), "--mode", "client"]
        words += ["--connect", self.endpoint, "--listen"]
        for name in services.NAMES:
            self._spawn(f"services.{name}", *words)
        self._spawn("services.recorder", *words, "--folder", str(folder / "recordings"))
        self._spawn("dashboard", *words, "--port", str(free_port()))
        deadline = time.monotonic() + LINK_TIMEOUT
        while True:
            try:
                client = connect(Cell((self.endpoint,), "cell", "client"))
                Operator.__init__(self, self._open.enter_context(client))
                break
            except Unreachable:
                if time.monotonic() > deadline:
                    raise
        self.await_all()

    def await_all(self) -> None:
        """Wait until every process is heard."""
        self.health.clear()
        names = {*services.NAMES, "recorder", "dashboard"}
        all_heard = lambda: self.health.keys() >= names  # noqa: E731
        self.wait_until(all_heard, READY_TIMEOUT, "not every process is heard")

    def start_router(self) -> None:
        """Start the router."""
        command = module_entry.command("shared.bus.router", "--listen", self.endpoint)
        self.router = subprocess.Popen(child_command(signal.SIGTERM, NICENESS, command))

    def _spawn(self, module: str, *words: str) -> None:
        command = child_command(signal.SIGTERM, NICENESS, module_entry.command(module, *words))
        process = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        self._open.callback(lambda: self.end(process))

    @staticmethod
    def end(process: subprocess.Popen[bytes]) -> None:
        """End a process."""
        process.terminate()
        process.wait()

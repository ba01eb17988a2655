"""`lariat up` for a bench: on free ports, in a folder of its own, with a person who talks to it."""

from __future__ import annotations

import os
import secrets
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping
from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from types import TracebackType

from shared.runtime.free_port import free_port
from stack import client
from stack.client import Client
from stack.launcher import module_entry
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT
from stack.launcher.process import child_command

START_TIMEOUT = 200.0
"""Longest wait for the stack; kernels may have to be compiled [s]."""
EXIT_TIMEOUT = 12.0
"""Longest wait for the stack to end before it is killed [s]."""
POLL_PERIOD = 0.05
"""Time between two looks at the output [s]."""


class LiveStack:
    """A stack with dashboard and recorder, up within its `with` block."""

    def __init__(
        self, scenario: Path, environment: Mapping[str, str] = {}, ros2: bool = False
    ) -> None:
        """Choose the ports of a stack, which may join ROS 2's graph and take commands there."""
        self._scenario, self._environment = scenario, environment
        self.ros2_router = f"tcp/127.0.0.1:{free_port()}" if ros2 else ""
        """Endpoint of ROS 2's router; empty without ROS 2."""
        self._resources = ExitStack()
        self.port = free_port()
        """Port of the hub on 127.0.0.1."""
        self.hub = f"tcp/127.0.0.1:{self.port}"
        """Endpoint of the hub."""
        self.namespace = f"bench-{secrets.token_hex(4)}"
        """Name of the cell on the bus."""
        self.folder = Path()
        """Folder in which it runs."""
        self.address = ""
        """Address of the page, with its token."""
        self.ready_after = 0.0
        """Time from the command until all processes were ready [s]."""

    @property
    def pid(self) -> int:
        """Id of the launcher's process."""
        return self._launcher.pid

    def __enter__(self) -> LiveStack:
        """Start the stack and wait until it is ready."""
        self.folder = Path(self._resources.enter_context(tempfile.TemporaryDirectory()))
        # As open as the folder in which a person starts it.
        self.folder.chmod(0o755)
        arguments = [str(self._scenario.resolve()), "--port", str(self.port)]
        arguments += ["--namespace", self.namespace, "--dashboard-port", str(free_port())]
        if self.ros2_router:
            arguments += ["--ros2", "--ros2-commands", "--ros2-router", self.ros2_router]
        log = self.folder / "up.txt"
        # SIGTERM, so that it ends the services when this process is killed.
        command = child_command(signal.SIGTERM, 0, module_entry.command("cli", "up", *arguments))
        begun = time.monotonic()
        with log.open("wb") as output:
            self._launcher = subprocess.Popen(
                command,
                cwd=self.folder,
                stdout=output,
                stderr=subprocess.STDOUT,
                env={**os.environ, **LIBRARY_ENVIRONMENT, **self._environment},
            )
        self._resources.callback(self._end)
        try:
            self.address = self._wait_for_address(log)
            self.ready_after = time.monotonic() - begun
        except BaseException:
            self._resources.close()
            raise
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End the stack."""
        self._resources.close()

    def connect(self) -> AbstractContextManager[Client]:
        """Return a connection to the stack, as a person's command line has it."""
        return client.connect(client.Cell((self.hub,), self.namespace))

    def _wait_for_address(self, log: Path) -> str:
        deadline = time.monotonic() + START_TIMEOUT
        while time.monotonic() < deadline and self._launcher.poll() is None:
            _, announced, rest = log.read_text(errors="replace").partition("dashboard at ")
            if announced and "\n" in rest:
                return rest.split()[0]
            time.sleep(POLL_PERIOD)
        raise RuntimeError(f"the stack does not start:\n{log.read_text(errors='replace')}")

    def _end(self) -> None:
        self._launcher.send_signal(signal.SIGINT)
        try:
            self._launcher.wait(EXIT_TIMEOUT)
        except subprocess.TimeoutExpired:
            self._launcher.kill()
            self._launcher.wait()

"""Project of containers in which a scenario is brought up, run to its goal and brought down."""

from __future__ import annotations

import json as encoder
import os
import subprocess
import time
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
"""Folder of the clone, with its compose file."""
COMMAND_TIMEOUT = 120.0
"""Longest duration of a verb in its container [s]."""
HEALTHY_TIMEOUT = 300.0
"""Longest wait for all containers to be healthy [s]."""
START_TIMEOUT = 60.0
"""Longest wait for the arms to be ready for a run [s]."""
RUN_TIMEOUT = 120.0
"""Longest wait for the goal [s]."""
RESTART_TIMEOUT = 90.0
"""Longest wait for a frozen process to be replaced [s]."""
POLL_PERIOD = 2.0
"""Time between two looks at a run [s]."""
OPERATOR_VERB = 'exec nice -n 19 lariat "$@" --mode client --connect tls/router:7448'
"""Command of the shell that runs one verb in the operator's container, beside the credentials."""
NICENESS = 19
"""Niceness of the engine's command line: the containers of a cell may together weigh as much as
one process of it."""


class ComposeProject:
    """Project of `docker compose`: its own containers, networks and volumes."""

    def __init__(self, name: str, files: tuple[Path, ...], scenario: str, port: int) -> None:
        """Args: name: Name of the project. files: Compose files. scenario: Name of the scenario.
        port: Port of the dashboard on this machine."""
        self.name = name
        self._command = ["nice", "-n", str(NICENESS), "docker", "compose", "-p", name]
        for file in files:
            self._command += ["-f", str(file)]
        self._environment = {**os.environ, "SCENARIO": scenario, "DASHBOARD_PORT": str(port)}
        self._operator = f"{name}-operator"
        """Name of a container that stays, in which verbs run: to start one takes from the cell."""

    def __call__(
        self, *arguments: str, timeout: float = COMMAND_TIMEOUT
    ) -> subprocess.CompletedProcess[str]:
        """Run one command of `docker compose`."""
        return subprocess.run(
            [*self._command, *arguments],
            cwd=ROOT,
            env=self._environment,
            capture_output=True,
            text=True,
            timeout=timeout,
        )

    def say(self, *verb: str) -> subprocess.CompletedProcess[str]:
        """Run one verb of `lariat` in the operator's container."""
        shell = ["sh", "-c", f"{OPERATOR_VERB} --settings /credentials/bus.json", "lariat", *verb]
        return subprocess.run(
            ["docker", "exec", self._operator, *shell],
            capture_output=True,
            text=True,
            timeout=COMMAND_TIMEOUT,
        )

    def status(self) -> dict[str, Any]:
        """Return the answer of `lariat status --json`; empty where there is none."""
        answer = self.say("status", "--json").stdout
        return encoder.loads(answer) if answer else {}

    def up(self) -> float:
        """Start all containers and return the time until they are healthy [s].

        Raises:
            TimeoutError: They do not become healthy in time.
        """
        began = time.monotonic()
        limit = str(round(HEALTHY_TIMEOUT))
        done = self(
            "up", "--detach", "--wait", "--wait-timeout", limit, timeout=2 * HEALTHY_TIMEOUT
        )
        if done.returncode:
            log = self("logs", "--tail", "20").stdout[-4000:]
            raise TimeoutError(f"not healthy: {done.stderr[-1000:]}\n{log}")
        healthy = time.monotonic() - began
        options = ("--detach", "--name", self._operator, "--entrypoint", "sleep")
        self("run", *options, "cli", "infinity")
        return healthy

    def start_run(self) -> None:
        """Arm the cell and start its run; acknowledge the holds of an overloaded machine.

        Raises:
            TimeoutError: The run is refused for too long.
        """
        deadline = time.monotonic() + START_TIMEOUT
        self.say("arm")
        # An arm takes some time to be enabled; until then a start is refused.
        while (started := self.say("start")).returncode:
            if time.monotonic() > deadline:
                raise TimeoutError(f"not started: {started.stderr}")
            self._go_on(self.status())
            time.sleep(POLL_PERIOD)

    def await_goal(self) -> None:
        """Wait until the goal is reached; acknowledge the holds of an overloaded machine.

        Raises:
            TimeoutError: It is not reached in time.
        """
        deadline = time.monotonic() + RUN_TIMEOUT
        while True:
            status = self.status()
            if (status.get("task") or {}).get("state") == "reached":
                return
            if time.monotonic() > deadline:
                raise TimeoutError(f"not reached: {status}")
            self._go_on(status)
            time.sleep(POLL_PERIOD)

    def _go_on(self, status: dict[str, Any]) -> None:
        """Acknowledge a stop and resume, if the arms wait for it."""
        arms = status.get("arms") or {}
        if arms.get("needs_acknowledgement"):
            self.say("ack")
        if arms.get("needs_acknowledgement") or arms.get("needs_resume"):
            self.say("resume")

    def freeze(self, service: str) -> float:
        """Stop a process without ending it; return the time until another one is healthy [s].

        Raises:
            TimeoutError: It is not replaced in time.
        """
        before = self("ps", "--quiet", service).stdout.strip()
        started = _inspect(before, "{{.State.StartedAt}}")
        subprocess.run(["docker", "exec", before, "sh", "-c", "kill -s STOP -- -1"], check=False)
        began = time.monotonic()
        while time.monotonic() < began + RESTART_TIMEOUT:
            state = _inspect(before, "{{.State.StartedAt}} {{.State.Health.Status}}").split()
            if state and state[0] != started and state[-1] == "healthy":
                return time.monotonic() - began
            time.sleep(0.5)
        raise TimeoutError(f"the frozen {service} was not replaced within {RESTART_TIMEOUT:.0f} s")

    def down(self) -> list[str]:
        """Remove the project, and return what is left of it."""
        subprocess.run(
            ["docker", "rm", "--force", self._operator], capture_output=True, check=False
        )
        self("--profile", "cli", "down", "--volumes", "--remove-orphans", "--timeout", "3")
        label = f"label=com.docker.compose.project={self.name}"
        left = []
        for kind, arguments in (
            ("container", ["ps", "--all", "--format", "{{.Names}}"]),
            ("network", ["network", "ls", "--format", "{{.Name}}"]),
            ("volume", ["volume", "ls", "--format", "{{.Name}}"]),
        ):
            listed = subprocess.run(
                ["docker", *arguments, "--filter", label], capture_output=True, text=True
            )
            left += [f"{kind} {name}" for name in listed.stdout.split()]
        return left


def _inspect(container: str, template: str) -> str:
    answer = subprocess.run(
        ["docker", "inspect", "--format", template, container], capture_output=True, text=True
    )
    return answer.stdout.strip()

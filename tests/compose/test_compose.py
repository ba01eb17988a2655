"""The stack in containers: built, brought up, armed, run to its goal, recorded, brought down."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from shared import topics
from shared.messages import RunState
from shared.recording import Recording

ROOT = Path(__file__).parents[2]
FILES = ("-f", "docker-compose.yml", "-f", "tests/compose/compose.ci.yml")

Compose = Callable[..., subprocess.CompletedProcess[str]]


def _engine() -> bool:
    try:
        return subprocess.run(["docker", "info"], capture_output=True, timeout=20).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


pytestmark = pytest.mark.skipif(not _engine(), reason="no container engine answers `docker info`")


@pytest.fixture(scope="module")
def wheels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The build of torch that this machine's package configuration offers."""
    folder = tmp_path_factory.mktemp("wheels")
    command = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "--dest", folder]
    subprocess.run([*command, "torch==2.13.0"], check=True, timeout=600)
    return folder


@pytest.fixture(scope="module")
def compose(wheels: Path) -> Iterator[Compose]:
    environment = {**os.environ, "LARIAT_WHEELS": str(wheels), "DASHBOARD_PORT": "18088"}
    project = f"lariat-test-{os.getpid()}"

    def call(*arguments: str, timeout: float = 120.0) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["docker", "compose", "-p", project, *FILES, *arguments],
            cwd=ROOT,
            env=environment,
            capture_output=True,
            text=True,
            timeout=timeout,
        )

    try:
        # The talking verbs' image belongs to a profile: built here, so that no call waits for it.
        built = call("--profile", "cli", "build", timeout=900.0)
        assert built.returncode == 0, built.stderr[-4000:]
        up = call("up", "--detach", "--wait", "--wait-timeout", "300", timeout=400.0)
        assert up.returncode == 0, up.stderr[-2000:] + call("logs", "--tail", "20").stdout[-4000:]
        yield call
    finally:
        call("down", "--volumes", "--timeout", "3")


def test_a_goal_is_reached_and_recorded_in_containers(compose: Compose, tmp_path: Path):
    def talk(*verb: str) -> subprocess.CompletedProcess[str]:
        return compose("run", "--rm", "-T", "cli", *verb)

    refused = talk("start")
    assert refused.returncode == 1, "a cell that nobody armed must not start"
    armed = talk("arm")
    assert armed.returncode == 0, armed.stderr
    started = talk("start")
    assert started.returncode == 0, started.stderr

    deadline, status = time.monotonic() + 90.0, {}
    while time.monotonic() < deadline:
        status = json.loads(talk("status", "--json").stdout)
        if status["task"] and status["task"]["state"] == "reached":
            break
        # A machine that is too busy makes the arms hold; a person looks, and goes on.
        if status["arms"] and status["arms"]["needs_acknowledgement"]:
            talk("ack")
        # Starting a container costs what the stack needs.
        time.sleep(4.0)
    assert status["task"]["state"] == "reached", status

    # The recorder ends a file with its run.
    copied = compose("cp", "recorder:/recordings/.", str(tmp_path))
    assert copied.returncode == 0, copied.stderr
    states = [
        entry.parse().state
        for path in sorted(tmp_path.glob("*.mcap"))
        for entry in Recording.open(path).messages([topics.TASK_STATE.key])
    ]
    assert RunState.Value("RUNNING") in states
    assert RunState.Value("REACHED") in states

"""The stack in containers: built, brought up, armed, run to its goal, recorded, brought down."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
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
def project(wheels: Path) -> Iterator[Compose]:
    """Calls of `docker compose` on a project whose images are built."""
    environment = {**os.environ, "LARIAT_WHEELS": str(wheels), "DASHBOARD_PORT": "18088"}
    name = f"lariat-test-{os.getpid()}"

    def call(
        *arguments: str, scenario: str = "three-cylinders", timeout: float = 120.0
    ) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            ["docker", "compose", "-p", name, *FILES, *arguments],
            cwd=ROOT,
            env={**environment, "SCENARIO": scenario},
            capture_output=True,
            text=True,
            timeout=timeout,
        )

    # The image of the command line belongs to a profile: built here, so that no call waits for it.
    built = call("--profile", "cli", "build", timeout=900.0)
    assert built.returncode == 0, built.stderr[-4000:]
    yield call
    call("down", "--volumes", "--timeout", "3")


@pytest.fixture(params=["three-cylinders", "fixed-end"])
def scenario(request: pytest.FixtureRequest) -> str:
    """One scenario without and one with a CR5."""
    return request.param


@pytest.fixture
def compose(scenario: str, project: Compose) -> Iterator[Compose]:
    """Calls on a stack that is up."""
    call = partial(project, scenario=scenario)
    try:
        up = call("up", "--detach", "--wait", "--wait-timeout", "300", timeout=400.0)
        assert up.returncode == 0, up.stderr[-2000:] + call("logs", "--tail", "20").stdout[-4000:]
        yield call
    finally:
        call("down", "--timeout", "3")


def test_a_goal_is_reached_and_recorded_in_containers(
    scenario: str, compose: Compose, tmp_path: Path
) -> None:
    def talk(*verb: str) -> subprocess.CompletedProcess[str]:
        return compose("run", "--rm", "-T", "cli", *verb)

    refused = talk("start")
    assert refused.returncode == 1, "a cell that nobody armed must not start"
    armed = talk("arm")
    assert armed.returncode == 0, armed.stderr
    # An arm takes some time to be enabled; until then a start is refused.
    deadline = time.monotonic() + 60.0
    while (started := talk("start")).returncode and time.monotonic() < deadline:
        time.sleep(2.0)
    assert started.returncode == 0, started.stderr

    deadline, status = time.monotonic() + 90.0, {}
    while time.monotonic() < deadline:
        status = json.loads(talk("status", "--json").stdout)
        if status["task"] and status["task"]["state"] == "reached":
            break
        # An overloaded machine makes the arms hold; the operator acknowledges and goes on.
        if status["arms"] and status["arms"]["needs_acknowledgement"]:
            talk("ack")
        elif status["arms"] and status["arms"]["needs_resume"]:
            talk("resume")
        # Starting a container takes processor time from the stack.
        time.sleep(4.0)
    assert status["task"]["state"] == "reached", status

    # The recorder closes a file with its run.
    copied = compose("cp", "recorder:/recordings/.", str(tmp_path))
    assert copied.returncode == 0, copied.stderr
    states = [
        entry.parse().state
        for path in sorted(tmp_path.glob(f"*_{scenario}.mcap"))
        for entry in Recording.open(path).messages([topics.TASK_STATE.key])
    ]
    assert RunState.Value("RUNNING") in states
    assert RunState.Value("REACHED") in states

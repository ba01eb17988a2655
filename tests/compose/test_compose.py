"""The stack in containers: built, brought up, armed, run to its goal, recorded, brought down."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from lariat.scenario.shipped import shipped_names
from shared import topics
from shared.messages import RunState
from shared.recording import Recording
from tests.compose.project import ComposeProject

RECORDING_TIMEOUT = 60.0
"""Longest wait for the end of a run in its recording [s]."""
POLL_PERIOD = 2.0
"""Time between two looks at the recordings [s]."""
ALWAYS = ("three-cylinders", "fixed-end")
"""Scenarios that are run each time: one without and one with a CR5."""
FILES = (Path("docker-compose.yml"), Path("tests/compose/compose.ci.yml"))


def _engine() -> bool:
    try:
        return subprocess.run(["docker", "info"], capture_output=True, timeout=20).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


pytestmark = [
    pytest.mark.live,
    pytest.mark.skipif(not _engine(), reason="no container engine answers `docker info`"),
]


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Callable[[str], ComposeProject]]:
    """Create the project of a scenario; its images are built."""
    os.environ["LARIAT_WHEELS"] = str(tmp_path_factory.mktemp("wheels"))
    name = f"lariat-test-{os.getpid()}"

    def create(scenario: str) -> ComposeProject:
        return ComposeProject(name, FILES, scenario, port=18088)

    # The image of the command line belongs to a profile: built here, so that no call waits for it.
    built = create("three-cylinders")("--profile", "cli", "build", timeout=900.0)
    assert built.returncode == 0, built.stderr[-4000:]
    yield create
    del os.environ["LARIAT_WHEELS"]


@pytest.fixture(
    params=[
        pytest.param(name, marks=() if name in ALWAYS else pytest.mark.slow)
        for name in shipped_names()
    ]
)
def scenario(request: pytest.FixtureRequest) -> str:
    """Each shipped scenario."""
    return request.param


@pytest.fixture
def compose(scenario: str, build: Callable[[str], ComposeProject]) -> Iterator[ComposeProject]:
    """Project of a scenario that is up."""
    project = build(scenario)
    try:
        project.up()
        yield project
    finally:
        left = project.down()
    assert left == []


def test_a_goal_is_reached_and_recorded_in_containers(
    scenario: str, compose: ComposeProject, tmp_path: Path
) -> None:
    refused = compose.say("start")
    assert refused.returncode == 1, "a cell that nobody armed must not start"
    compose.start_run()
    compose.await_goal()

    # The recorder closes a file with its run, when it has written what waits.
    deadline = time.monotonic() + RECORDING_TIMEOUT
    states = recorded_states(compose, scenario, tmp_path / "0")
    while RunState.Value("REACHED") not in states and time.monotonic() < deadline:
        time.sleep(POLL_PERIOD)
        states = recorded_states(compose, scenario, tmp_path / f"{time.monotonic():.0f}")
    assert RunState.Value("RUNNING") in states
    assert RunState.Value("REACHED") in states

    if scenario not in ALWAYS:
        # A controller that is frozen is replaced, and the arms hold.
        compose.freeze("controller")
        assert (compose.status().get("arms") or {}).get("mode") in ("holding", "armed")


def recorded_states(compose: ComposeProject, scenario: str, folder: Path) -> list[int]:
    """Return the states of the task in all recordings of a scenario, copied to a new folder."""
    folder.mkdir()
    copied = compose("cp", "recorder:/recordings/.", str(folder))
    assert copied.returncode == 0, copied.stderr
    return [
        entry.parse().state
        for path in sorted(folder.glob(f"*_{scenario}.mcap"))
        for entry in Recording.open(path).messages([topics.TASK_STATE.key])
    ]

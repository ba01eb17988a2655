"""The main job: a rope round three cylinders into its goal, seen through the camera."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from cli import replay
from shared import topics
from shared.messages import REACHED
from shared.recording import Recording
from stack.simulation.closed_loop import RunOutcome
from tests.closed_loop.loop import first_difference, messages, run

NAME = "three-cylinders"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("runs") / "camera.mcap"


@pytest.fixture(scope="module")
def seen(path: Path) -> RunOutcome:
    return run(NAME, "run.time_limit=6.0", record=path)


def test_the_rope_reaches_its_goal_through_the_camera(seen: RunOutcome):
    score = seen.score
    assert score.reached, seen.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 5.0
    assert score.length_error_mm < 1.0
    assert score.contact_time_s == 0.0
    task = seen.stack.latest(topics.TASK_STATE)
    assert task is not None
    assert task.state == REACHED


def test_with_a_true_view_of_the_rope_the_error_is_below_half_a_millimetre():
    outcome = run(NAME, "sensing.source=truth", "run.time_limit=4.0")
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 0.5
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 5.0


def test_the_same_seed_gives_the_same_bytes_and_another_does_not():
    settings = ("run.time_limit=0.8",)
    one = messages(NAME, *settings)
    assert first_difference(one, messages(NAME, *settings)) == ""
    other = messages(NAME, *settings, "seed=1")
    assert "camera/overhead" in first_difference(one, other)


def test_the_recorded_services_say_the_same_again(seen: RunOutcome, path: Path, tmp_path: Path):
    recording = Recording.open(path)
    scenario = recording.scenario(tmp_path)
    names = ("controller", "perception", "planner", "robot_gateway")
    results = replay.replay(recording, scenario, names, Console(stderr=True))
    for result in results:
        assert result.notes == []
        assert result.differences[:3] == []
        assert sum(result.compared.values()) > 3


def test_the_gripper_never_moves_faster_than_its_limits(seen: RunOutcome, path: Path):
    limits = seen.scorer.scenario.limits
    states = [e.parse() for e in Recording(path).messages(["arm/state"])]
    stamps = np.array([s.stamp for s in states]) / 1e9
    for arm in range(2):
        positions = np.array([s.arms[arm].position for s in states])
        velocity = np.diff(positions, axis=0) / np.diff(stamps)[:, None]
        acceleration = np.diff(velocity, axis=0) / np.diff(stamps)[1:, None]
        assert np.max(np.linalg.norm(velocity, axis=1)) <= 1.02 * limits.speed
        # Each axis; twice differenced over 8 ms.
        assert np.max(np.abs(acceleration)) <= 1.5 * limits.acceleration

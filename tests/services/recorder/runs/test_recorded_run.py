"""Motion and pictures of a recorded run."""

from __future__ import annotations

import math
import shutil
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from services.recorder.runs.recorded_run import RecordedRun
from shared import topics
from shared.messages import RunMotion, RunPicture, RunSummary, chain
from shared.recording import Recording

REPLAY = Path(__file__).parents[3] / "replay"


def run_of(folder: Path, name: str) -> RunSummary:
    """The first run of a reference recording, with the file in a folder."""
    shutil.copy(REPLAY / f"{name}.mcap", folder)
    for entry in Recording(folder / f"{name}.mcap").messages([topics.TASK_STATE.key]):
        task = entry.parse()
        if task.run_started:
            files = [f"{name}.mcap"]
            return RunSummary(
                id="run-1", run=task.run, started=task.run_started, files=files, over=True
            )
    raise AssertionError(name)


def taken(recorded: RecordedRun) -> Any:
    deadline = time.monotonic() + 20.0
    while time.monotonic() < deadline:
        for publication in recorded.take(7):
            return publication.message
        time.sleep(0.005)
    raise AssertionError("nothing was read")


def test_motion_holds_shapes_goal_and_what_happened(tmp_path: Path) -> None:
    run = run_of(tmp_path, "requests")
    recorded = RecordedRun(tmp_path)
    recorded.read_motion(run)
    motion = taken(recorded)
    assert isinstance(motion, RunMotion)
    assert (motion.run, motion.stamp) == ("run-1", 7)
    times = np.array(motion.time)
    assert len(motion.nodes) == 3 * motion.node_count * len(times)
    assert np.all(np.diff(times) >= 1.0 / 15.0 - 1e-9)
    seen = Recording(tmp_path / "requests.mcap").messages([topics.ROPE_NODES.key])
    (first,) = [
        chain(e.parse().positions)
        for e in seen
        if math.isclose((e.log_time - run.started) / 1e9, times[0])
    ]
    shapes = np.array(motion.nodes).reshape(len(times), -1, 3)
    np.testing.assert_allclose(shapes[0], first, atol=1e-6)
    assert len(motion.goal) == 3 * motion.node_count
    assert motion.marks[0].text == "start"
    assert abs(motion.marks[0].time) < 0.1
    assert any(mark.text.startswith("hold: ") for mark in motion.marks)


def test_picture_is_the_nearest_one(tmp_path: Path) -> None:
    run = run_of(tmp_path, "rope")
    times = [
        (entry.log_time - run.started) / 1e9
        for entry in Recording(tmp_path / "rope.mcap").messages()
        if topics.CAMERA_COLOR.matches(entry.key)
    ]
    recorded = RecordedRun(tmp_path)
    for wanted in (-1e3, 0.1, 1e3):
        recorded.read_picture(run, wanted)
        picture = taken(recorded)
        assert isinstance(picture, RunPicture)
        assert picture.time == min(times, key=lambda t: abs(t - wanted))
        assert picture.data[:2] == b"\xff\xd8"


def test_run_without_camera_has_an_empty_picture(tmp_path: Path) -> None:
    recorded = RecordedRun(tmp_path)
    recorded.read_picture(run_of(tmp_path, "requests"), 0.1)
    assert not taken(recorded).data


def test_deleted_recording_and_impossible_time_are_refused(tmp_path: Path) -> None:
    run = run_of(tmp_path, "requests")
    recorded = RecordedRun(tmp_path)
    with pytest.raises(ValueError, match="no time"):
        recorded.read_picture(run, math.inf)
    (tmp_path / "requests.mcap").unlink()
    with pytest.raises(ValueError, match="has been deleted"):
        recorded.read_motion(run)


def test_broken_recording_says_why_it_cannot_be_read(tmp_path: Path) -> None:
    run = run_of(tmp_path, "requests")
    (tmp_path / "requests.mcap").write_bytes(b"no recording")
    recorded = RecordedRun(tmp_path)
    recorded.read_motion(run)
    motion = taken(recorded)
    assert motion.marks[0].text.startswith("cannot be read: ")
    assert not motion.nodes

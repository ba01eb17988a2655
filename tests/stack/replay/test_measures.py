"""Measures of a recorded run, computed again."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cli import replay
from shared import topics
from shared.recording import Recording, Writer
from stack.replay.measures import recorded_measures
from stack.simulation import closed_loop
from stack.simulation.score import Score
from tests.stack import small_cell


@pytest.fixture
def run(tmp_path: Path) -> tuple[Path, Score]:
    scenario = small_cell.scenario(tmp_path)
    path = tmp_path / "run.mcap"
    outcome = closed_loop.run(scenario, path, members=small_cell.members(scenario))
    return path, outcome.score


MEASURES = (
    "reached",
    "reached_s",
    "final_error_mm",
    "max_node_error_mm",
    "final_shape_error_mm",
    "min_clearance_mm",
    "contact_time_s",
    "replans",
    "sim_s",
)


def copied(path: Path, scenario, keep) -> Recording:
    """The recording without some messages."""
    recording = Recording.open(path)
    entries = [entry for entry in recording.messages() if keep(entry)]
    name = path.with_name("copy.mcap")
    writer = Writer(name, scenario, entries[0].log_time)
    for e in entries:
        writer.write(e.topic, e.payload, e.publisher, e.sequence, e.log_time)
    writer.close()
    return Recording.open(name)


def test_measures_are_those_of_the_run(run: tuple[Path, Score], tmp_path: Path) -> None:
    path, score = run
    again = recorded_measures(Recording.open(path), small_cell.scenario(tmp_path))
    assert again.by_truth
    for name in MEASURES:
        assert getattr(again.score, name) == getattr(score, name), name


def test_without_the_truth_the_seen_rope_is_measured(
    run: tuple[Path, Score], tmp_path: Path
) -> None:
    path, _ = run
    scenario = small_cell.scenario(tmp_path)
    recording = copied(path, scenario, lambda e: e.key != topics.ROPE_TRUTH.key)
    again = recorded_measures(recording, scenario)
    assert not again.by_truth
    assert again.score.final_error_mm is not None
    chains = [e.parse() for e in recording.messages([topics.ROPE_NODES.key])]
    assert again.score.sim_s == pytest.approx(
        (chains[-1].stamp - next(_starts(recording))) / 1e9, abs=1e-3
    )


def _starts(recording: Recording):
    for entry in recording.messages([topics.TASK_STATE.key]):
        if started := entry.parse().run_started:
            yield started


def test_recording_without_a_run_is_refused(run: tuple[Path, Score], tmp_path: Path) -> None:
    path, _ = run
    scenario = small_cell.scenario(tmp_path)
    idle = copied(path, scenario, lambda e: e.key != topics.TASK_STATE.key)
    with pytest.raises(ValueError, match="holds no run"):
        recorded_measures(idle, scenario)


def test_command_prints_measures_and_the_recorded_result(
    run: tuple[Path, Score], capsys: pytest.CaptureFixture[str]
) -> None:
    path, score = run
    assert replay.main(path, measures=True, json=True) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["final_error_mm"] == score.final_error_mm
    assert printed["by_truth"] is True
    assert replay.main(path, measures=True) == 0
    assert "by the true rope, computed again" in capsys.readouterr().out

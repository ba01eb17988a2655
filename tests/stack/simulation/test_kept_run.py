"""Simulated runs in the list of runs."""

from __future__ import annotations

from pathlib import Path

from lariat.scenario import load
from lariat.trajectory import SECOND
from services.recorder.runs.run_folder import RunFolder
from shared import topics
from shared.messages import REACHED, RUNNING, Message, RunResult, TaskState
from shared.topics import Topic
from stack.simulation.kept_run import KeptRun
from stack.simulation.simulated_time import START, Delivery


def delivery(topic: Topic, message: Message) -> Delivery:
    payload = message.SerializeToString()
    return Delivery(topic, payload, "controller-0", 1, START)


def test_run_is_listed_with_its_curves_its_note_and_the_recording_beside_it(tmp_path: Path) -> None:
    kept = KeptRun(load("three-cylinders"), tmp_path, tmp_path / "a.mcap", "seed 3")
    task = TaskState(run="run-1", run_started=START, state=RUNNING, error=0.1, clearance=0.02)
    for k in range(3):
        task.stamp = START + k * SECOND
        kept(delivery(topics.TASK_STATE, task))
    task.state = REACHED
    kept(delivery(topics.TASK_STATE, task))
    result = RunResult(run="run-1", reached=True, duration=2.0, error=0.0004)
    kept(delivery(topics.RUN_RESULT, result))
    kept.keep()
    folder = RunFolder(tmp_path)
    folder.load(START)
    (run,) = folder.summaries()
    assert (run.reached, run.over, run.error, run.note) == (True, True, 0.0004, "seed 3")
    assert list(run.files) == ["a.mcap"]
    assert list(folder.named(run.id).curves.time) == [0.0, 1.0, 2.0]


def test_recording_elsewhere_is_not_named_and_no_run_is_not_listed(tmp_path: Path) -> None:
    kept = KeptRun(load("three-cylinders"), tmp_path / "list", tmp_path / "a.mcap", "")
    kept.keep()
    assert not (tmp_path / "list").exists()
    kept(delivery(topics.TASK_STATE, TaskState(run="run-1", run_started=START, state=RUNNING)))
    kept.keep()
    folder = RunFolder(tmp_path / "list")
    folder.load(START)
    assert [list(run.files) for run in folder.summaries()] == [[]]

"""Runs of the recorder: what is kept of them, and what people ask for."""

from __future__ import annotations

import json
import math
from pathlib import Path
from threading import Event
from typing import Any

import numpy as np
import pytest

from lariat.scenario import load
from lariat.trajectory import SECOND
from services.recorder.runs import run_folder
from services.recorder.runs.runs import Runs
from shared import topics
from shared.door import Door
from shared.messages import (
    IDLE,
    REACHED,
    RUNNING,
    RunCurves,
    RunList,
    RunListRequest,
    RunResult,
    TaskState,
    validation,
)

SCENARIO = load(Path(__file__).parents[4] / "scenarios" / "three-cylinders.toml")
START = 1_790_000_000 * SECOND


class Recorder:
    """Runs of a folder, fed with what a controller publishes."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.runs = Runs(SCENARIO, folder, Door())
        self.runs.load()
        self.now = START
        self.file = ""

    def step(self, *requests: RunListRequest) -> list[Any]:
        self.now += SECOND
        return [p.message for p in self.runs.step(requests, self.file, self.now)]

    def listed(self, *requests: RunListRequest) -> RunList:
        (found,) = (m for m in self.step(*requests) if isinstance(m, RunList))
        return found

    def run(self, name: str, started: float, clearances: tuple[float, ...] = (0.03, 0.02)) -> str:
        """One run from its start to its goal, in a recording of its own; its id."""
        at = START + round(started * SECOND)
        self.file = f"{name}.mcap"
        (self.folder / self.file).write_bytes(b"0" * 1000)
        task = TaskState(run=name, run_started=at, state=RUNNING, stamp=at, error=0.1)
        for k, clearance in enumerate(clearances):
            task.stamp, task.clearance = at + k * SECOND, clearance
            self.runs.take_task(task)
            self.step()
            self.runs.take_result(RunResult(run=name, min_clearance=min(clearances)))
        task.state = REACHED
        self.runs.take_task(task)
        result = RunResult(run=name, reached=True, duration=2.0, error=0.0004, min_clearance=0.02)
        self.runs.take_result(result)
        self.file = ""
        return self.listed().runs[0].id


def test_run_is_listed_with_its_result_and_its_recording(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    (run,) = recorder.listed().runs
    assert (run.run, run.scenario, run.reached, run.over) == (
        "run-1",
        "three-cylinders",
        True,
        True,
    )
    assert (run.error, run.min_clearance, run.duration) == (0.0004, 0.02, 2.0)
    assert (list(run.files), run.bytes) == (["run-1.mcap"], 1000)
    assert run.method == SCENARIO.control.method
    # As another start of the recorder lists it.
    (again,) = Recorder(tmp_path).listed().runs
    assert again == run
    assert id == run.id


def test_newest_run_comes_first_and_is_not_mixed_up_with_one_of_its_name(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    ids = [recorder.run("run-1", 0.0), recorder.run("run-2", 60.0), recorder.run("run-1", 120.0)]
    assert [run.id for run in recorder.listed().runs] == ids[::-1]


def test_curves_hold_every_state_and_say_where_there_was_no_clearance(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0, clearances=(math.inf, 0.03, 0.02))
    request = RunListRequest(id="a", action=RunListRequest.SEND_CURVES, runs=[id])
    (curves,) = (m for m in recorder.step(request) if isinstance(m, RunCurves))
    np.testing.assert_allclose(curves.time, [0.0, 1.0, 2.0])
    np.testing.assert_allclose(curves.clearance, [-1.0, 0.03, 0.02])


def test_note_and_star_stay_with_the_run(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    request = RunListRequest(
        id="a", action=RunListRequest.ANNOTATE, runs=[id], note="stiff cable", star=True
    )
    (run,) = recorder.listed(request).runs
    assert (run.note, run.star) == ("stiff cable", True)
    # A later result of the same run does not take them away.
    recorder.runs.close()
    (again,) = Recorder(tmp_path).listed().runs
    assert (again.note, again.star) == ("stiff cable", True)


def test_deleted_run_leaves_nothing_but_the_recordings_that_others_need(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    first, second = recorder.run("run-1", 0.0), recorder.run("run-2", 60.0)
    answer = recorder.listed(RunListRequest(id="a", action=RunListRequest.DELETE, runs=[first]))
    assert (answer.last_request, answer.refusal) == ("a", "")
    assert [run.id for run in answer.runs] == [second]
    assert [p.name for p in tmp_path.rglob("*") if p.is_file()] == ["run-2.mcap", f"{second}.json"]


@pytest.mark.parametrize(
    ("action", "runs", "fields", "words"),
    [
        (RunListRequest.DELETE, ["../../etc/passwd"], {}, "no run '../../etc/passwd'"),
        (RunListRequest.DELETE, [], {}, "names 0 runs"),
        (RunListRequest.SEND_CURVES, ["x"] * 9, {}, "names 9 runs"),
        (RunListRequest.UNSPECIFIED, ["ID"], {}, "no action 0"),
        (RunListRequest.ANNOTATE, ["ID"], {"note": "n" * 201}, "201 characters"),
    ],
)
def test_request_that_cannot_be_carried_out_is_refused_with_its_reason(
    tmp_path: Path, action: RunListRequest.Action, runs: list[str], fields: dict, words: str
) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    named = [id if run == "ID" else run for run in runs]
    answer = recorder.listed(RunListRequest(id="a", action=action, runs=named, **fields))
    assert words in answer.refusal
    assert len(answer.runs) == 1


def test_run_that_is_being_recorded_is_not_deleted(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    recorder.file = "run-1.mcap"
    answer = recorder.listed(RunListRequest(id="a", action=RunListRequest.DELETE, runs=[id]))
    assert "being recorded" in answer.refusal


def test_result_of_a_stranger_and_a_task_without_a_run_are_no_run(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    recorder.runs.take_task(TaskState(state=IDLE))
    recorder.runs.take_result(RunResult(run="run-9", reached=True))
    for k in range(5):
        recorder.runs.take_task(TaskState(state=RUNNING, run=f"forged-{k}", run_started=START))
    assert list(recorder.listed().runs) == []
    assert not (tmp_path / "runs").exists()


def test_file_that_is_no_run_is_left_out(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    (tmp_path / "runs" / "broken.json").write_text("{")
    (tmp_path / "runs" / "copied.json").write_text((tmp_path / "runs" / f"{id}.json").read_text())
    again = Recorder(tmp_path)
    assert [run.id for run in again.listed().runs] == [id]
    assert "broken.json" in caplog.text
    assert "copied.json" in caplog.text


def test_run_that_another_process_keeps_is_listed(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    own = recorder.run("run-1", 0.0)
    (written,) = (tmp_path / "runs").glob("*.json")
    text = written.read_text().replace(own, "trial")
    (tmp_path / "runs" / "trial.json").write_text(text)
    assert {run.id for run in recorder.listed().runs} == {own, "trial"}
    (request,) = [
        m
        for m in recorder.step(RunListRequest(action=RunListRequest.SEND_CURVES, runs=["trial"]))
        if isinstance(m, RunCurves)
    ]
    assert len(request.time) == 2


def test_run_whose_recording_is_a_link_in_a_circle_is_listed(tmp_path: Path) -> None:
    id = Recorder(tmp_path).run("run-1", 0.0)
    (tmp_path / "run-1.mcap").unlink()
    (tmp_path / "run-1.mcap").symlink_to("run-1.mcap")
    (run,) = Recorder(tmp_path).listed().runs
    assert (run.id, run.bytes) == (id, 0)


def test_file_that_nests_without_end_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "evil.json").write_text('{"a":' + "[" * 200_000)
    recorder = Recorder(tmp_path)
    assert list(recorder.listed().runs) == []
    assert recorder.run("first", 1.0)


@pytest.mark.parametrize(
    "changes",
    [
        {"note": "n" * 5000},
        {"reason": "r" * 9000},
        {"files": ["f.mcap"] * 5000},
        {"error": "NaN", "version": "v" * 5000},
    ],
)
def test_one_file_does_not_spoil_the_list_of_runs(tmp_path: Path, changes: dict) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    run = json.loads((tmp_path / "runs" / f"{id}.json").read_text())
    run["summary"] |= {"id": "evil", **changes}
    (tmp_path / "runs" / "evil.json").write_text(json.dumps(run))
    listed = Recorder(tmp_path).listed()
    assert [run.id for run in listed.runs] == [id]
    validation.decode(topics.RUN_LIST, listed.SerializeToString())


def test_runs_of_any_names_and_reasons_are_a_list_that_everybody_takes(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    for k in range(250):
        started = START + k * SECOND
        task = TaskState(run=f"{k}" + "\U0001f980" * 4000, run_started=started, stamp=started)
        for state in (RUNNING, REACHED):
            task.state = state
            recorder.runs.take_task(task)
        result = RunResult(run=task.run, reached=True, reason="\U0001f980" * 4096)
        recorder.runs.take_result(result)
    listed = recorder.listed()
    assert len(listed.runs) == 250
    validation.decode(topics.RUN_LIST, listed.SerializeToString())
    assert len(Recorder(tmp_path).listed().runs) == 250


def test_deleting_a_run_deletes_recordings_of_that_run_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = Recorder(tmp_path)
    old = recorder.run("old", 0.0)
    id = recorder.run("evil", 60.0)
    (tmp_path / "goals").mkdir()
    kept = [tmp_path / "goals" / "mine.json", tmp_path / "thesis.pdf", tmp_path / "old.mcap"]
    kept += [tmp_path / "runs" / f"{old}.json"]
    for path in kept[:2]:
        path.write_text("mine")
    path = tmp_path / "runs" / f"{id}.json"
    run = json.loads(path.read_text())
    run["summary"]["files"] += [str(p.relative_to(tmp_path)) for p in kept]
    path.write_text(json.dumps(run))
    # The older run is not listed any more.
    monkeypatch.setattr(run_folder, "MAX_RUNS", 1)
    again = Recorder(tmp_path)
    request = RunListRequest(id="a", action=RunListRequest.DELETE, runs=[id])
    assert again.listed(request).refusal == ""
    assert all(path.exists() for path in kept)
    assert not (tmp_path / "evil.mcap").exists()


def test_many_requests_for_a_motion_do_not_queue_for_hours(tmp_path: Path) -> None:
    recorder = Recorder(tmp_path)
    id = recorder.run("run-1", 0.0)
    busy = Event()
    recorder.runs._recorded._thread.submit(busy.wait, 20.0)
    request = RunListRequest(id="a", action=RunListRequest.SEND_MOTION, runs=[id])
    refusals = [recorder.listed(request).refusal for _ in range(20)]
    busy.set()
    assert refusals[0] == ""
    assert refusals[-1].startswith("16 runs wait")
    recorder.runs.close()

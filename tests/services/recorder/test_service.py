"""Recorder: one file for each run with every message, also when the disk is full."""

from __future__ import annotations

import errno
import logging
import os
import random
import shutil
import threading
from dataclasses import replace
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.Log_pb2 import Log

from lariat.configuration import ConfigurationError
from lariat.scenario import parse
from lariat.trajectory import SECOND
from services.recorder import run_files
from services.recorder.options import RecorderOptions
from services.recorder.runs.run_folder import RunFolder
from services.recorder.service import RecorderService, build
from shared import topics
from shared.bus import RawMessage
from shared.messages import (
    FAILED,
    IDLE,
    REACHED,
    RUNNING,
    ArmCommand,
    ArmState,
    ArmStates,
    NodeChain,
    RunFile,
    RunResult,
    RunSummary,
    TaskState,
)
from shared.recording import Recording
from shared.runtime.service import Inbox
from tests.shared.cell import until

TEXT = """
name = "three posts"
[rope]
length = 0.45
diameter = 0.008
[start]
line = [[-0.2, 0.0, 0.3], [0.2, 0.0, 0.3]]
[goal]
line = [[-0.2, 0.1, 0.3], [0.2, 0.1, 0.3]]
[[obstacles]]
shape = "capsule"
position = [0.0, 0.3, 0.2]
radius = 0.02
height = 0.1
"""
NOW = 1_780_000_000 * SECOND


def heard(key: str, payload: bytes, publisher: str, sequence: int, received: int) -> RawMessage:
    return RawMessage(key, "", payload, publisher, sequence, received)


def runs_of(folder: Path) -> list[Path]:
    """Files that hold every message, in order of time."""
    files = (p for p in folder.glob("*.mcap") if not p.name.endswith("_idle.mcap"))
    return sorted(files, key=lambda path: (path.name[:19], len(path.name), path.name))


class Cell:
    """Recorder with messages and a clock of the test's own."""

    def __init__(
        self,
        folder: Path,
        keep: float | None = RecorderOptions.keep,
        always: bool = False,
        **recording: float,
    ) -> None:
        scenario = parse(TEXT, folder)
        scenario = replace(scenario, recording=replace(scenario.recording, **recording))
        options = RecorderOptions(folder, always=always, keep=keep)
        self.recorder: RecorderService = build(scenario, "r", options)
        self.now = NOW
        self.sequences: dict[str, int] = {}
        self.said: list = []

    def hear(self, topic, message, skip: int = 0) -> None:
        sequence = self.sequences.get(topic.key, 0) + skip
        self.sequences[topic.key] = sequence + 1
        self.recorder.tap(heard(topic.key, message.SerializeToString(), "p-0", sequence, self.now))

    def live(self, seconds: float, state: int = IDLE, run: str = "") -> None:
        for _ in range(round(30 * seconds)):
            task = TaskState(stamp=self.now, state=state, run=run)
            self.hear(topics.TASK_STATE, task)
            self.said += self.recorder.step(Inbox({}, {}), self.now)
            self.now += SECOND // 30

    def states(self) -> list:
        return [m for topic, m in self.said if topic.key == "run/record"]


def test_every_run_has_a_file_from_idle_to_its_end(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0)
    cell.live(2.0, RUNNING, "run-1")
    cell.live(2.5, REACHED, "run-1")
    cell.live(1.0, REACHED, "run-1")
    cell.live(1.0, RUNNING, "run-2")
    cell.live(1.0, RUNNING, "run-3")
    cell.live(1.0, IDLE, "run-3")
    cell.recorder.close()
    files = runs_of(tmp_path)
    runs = []
    for file in files:
        states = [e.parse() for e in Recording(file).messages(["task/state"])]
        runs.append(list(dict.fromkeys((s.state, s.run) for s in states if s.state == RUNNING)))
        assert Recording.open(file).metadata["scenario"] == "three posts"
    assert runs == [[(RUNNING, f"run-{k}")] for k in (1, 2, 3)]
    first = [e.parse() for e in Recording(files[0]).messages(["task/state"])]
    assert first[0].state == IDLE
    assert first[-1].state == REACHED
    assert files[0].name == "2026-05-28_20-26-41_three-posts.mcap"


def following(speed: float) -> ArmStates:
    """Arms that follow setpoints, the left one at a speed [m/s]."""
    arms = [
        ArmState(arm=side, linear_velocity=[v, 0.0, 0.0], angular_velocity=[0.0] * 3)
        for side, v in (("left", speed), ("right", 0.0))
    ]
    return ArmStates(mode=ArmStates.MOVING, arms=arms)


def test_arms_that_move_on_after_a_run_stay_in_its_file(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0, RUNNING, "run-1")
    for _ in range(90):
        cell.hear(topics.ARM_STATE, following(0.1))
        cell.live(1 / 30, REACHED, "run-1")
    cell.live(5.0, REACHED, "run-1")
    cell.recorder.close()
    assert len(runs_of(tmp_path)) == 1


def test_file_of_a_run_ends_although_the_arms_go_on_to_follow_setpoints_at_rest(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0, RUNNING, "run-1")
    for _ in range(90):
        cell.hear(topics.ARM_STATE, following(0.001))
        cell.live(1 / 30, REACHED, "run-1")
    assert [s.run for s in cell.states()][-1] == ""
    assert len(list(tmp_path.glob("*_idle.mcap"))) == 1


def test_a_failed_run_ends_its_file_too(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0, RUNNING, "run-1")
    cell.live(3.0, FAILED, "run-1")
    assert [s.run for s in cell.states()][-1] == ""
    assert len(runs_of(tmp_path)) == 1
    assert len(list(tmp_path.glob("*_idle.mcap"))) == 1


def test_what_is_written_survives_without_a_clean_end(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(5.0, RUNNING, "run-1")
    (file,) = tmp_path.glob("*.mcap")
    recording = Recording(file)
    assert len(list(recording.messages())) >= 30 * 4 - 1
    assert recording.damage


def test_state_counts_recorded_and_lost_messages(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0)
    cell.hear(topics.ROPE_NODES, NodeChain(stamp=1))
    cell.hear(topics.ROPE_NODES, NodeChain(stamp=2), skip=3)
    cell.live(2.0, RUNNING, "run-1")
    state = cell.states()[-1]
    assert state.recording
    assert state.run == "run-1"
    assert state.drops == 3
    assert state.bytes > 0
    # Once a second, and when the run began.
    assert 3 <= len(cell.states()) <= 5
    assert Path(state.file).exists()


def test_state_says_how_much_the_recordings_take_and_the_disk_has_left(tmp_path: Path):
    (tmp_path / "2026-01-01_00-00-00_a.mcap").write_bytes(bytes(4_000_000))
    (tmp_path / "2026-01-02_00-00-00_a.mcap").symlink_to(tmp_path / "missing")
    cell = Cell(tmp_path)
    cell.live(2.0)
    cell.recorder.close()
    state = cell.states()[-1]
    assert 4_000_000 < state.recordings_size < 4_200_000
    assert state.free_space == pytest.approx(shutil.disk_usage(tmp_path).free, rel=0.05)


def test_images_are_left_out_and_counted_where_too_many_wait(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setattr("services.recorder.run_files.MAX_PRE_ROLL_SIZE", 2**21)
    cell = Cell(tmp_path)
    cell.live(1.0, RUNNING, "run-1")
    color, image = topics.CAMERA_COLOR.at("overhead"), CompressedImage(data=bytes(2**19))
    for _ in range(8):
        cell.hear(color, image)
        cell.hear(topics.ROPE_NODES, NodeChain(stamp=1))
    cell.live(2.0, RUNNING, "run-1")
    cell.recorder.close()
    (run,) = runs_of(tmp_path)
    assert len(stamps(run, color.key)) == 3
    assert len(stamps(run, topics.ROPE_NODES.key)) == 8
    assert cell.states()[-1].drops == 5


def stamps(path: Path, key: str) -> list[float]:
    """Times of a topic's messages since the start of the test [s]."""
    return [(e.log_time - NOW) / SECOND for e in Recording(path).messages([key])]


def test_a_run_has_a_pre_roll_and_an_idle_cell_is_recorded_lightly(tmp_path: Path):
    cell = Cell(tmp_path, start_up=30.0)
    color = topics.CAMERA_COLOR.at("overhead")
    for second in range(60):
        cell.hear(color, CompressedImage(data=bytes([second])))
        cell.live(1.0)
    cell.hear(topics.ARM_COMMAND, ArmCommand(id="kept"))
    cell.live(1.0, RUNNING, "run-1")
    cell.recorder.close()
    start, run = runs_of(tmp_path)
    (idle,) = tmp_path.glob("*_idle.mcap")
    # The start is recorded whole.
    assert len(stamps(start, color.key)) == pytest.approx(30, abs=1)
    # Then states once a second, and no images.
    assert len(stamps(idle, "task/state")) == pytest.approx(30, abs=1)
    assert stamps(idle, color.key) == []
    # The run's file begins three seconds before it, with every message.
    assert stamps(run, color.key) == pytest.approx([57, 58, 59], abs=0.1)
    assert stamps(run, "task/state")[0] == pytest.approx(57.0, abs=0.1)
    assert len(stamps(run, "task/state")) == pytest.approx(120, abs=3)
    assert [e.parse().id for e in Recording(run).messages(["arm/command"])] == ["kept"]
    about = Recording.open(run).metadata
    assert (about["kind"], about["continues"]) == ("run", idle.name)


def test_requests_of_persons_to_an_idle_cell_are_all_recorded(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(1.0)
    for k in range(20):
        cell.hear(topics.ARM_COMMAND, ArmCommand(id=str(k)))
    cell.live(5.0)
    cell.recorder.close()
    (idle,) = tmp_path.glob("*.mcap")
    assert len(stamps(idle, "arm/command")) == 20


@pytest.mark.parametrize("last", [REACHED, IDLE])
def test_a_run_that_a_late_step_meets_whole_is_recorded(tmp_path: Path, last: int):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(3.0)
    started = cell.now
    for k in range(240):
        state = RUNNING if k < 150 else last
        task = TaskState(stamp=cell.now, state=state, run="run-1", run_started=started)
        cell.hear(topics.TASK_STATE, task)
        cell.now += SECOND // 30
    cell.hear(topics.RUN_RESULT, RunResult(run="run-1", reached=True))
    cell.live(2.0)
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    states = [e.parse().state for e in Recording(file).messages(["task/state"])]
    assert states.count(RUNNING) == 150
    (summary,) = [m for topic, m in cell.said if topic.key == topics.RUN_LIST.key][-1].runs
    assert list(summary.files) == [file.name]


def test_a_moving_arm_is_recorded_like_a_run(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(5.0)
    for _ in range(30):
        cell.hear(topics.ARM_STATE, following(0.1))
        cell.live(0.1)
    cell.live(4.0)
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    times = stamps(file, "task/state")
    assert (times[0], times[-1]) == pytest.approx((2.0, 10.0), abs=0.2)
    assert len(times) == pytest.approx(240, abs=5)


def test_a_file_is_followed_by_the_next_after_a_time_and_after_a_size(tmp_path: Path):
    cell = Cell(tmp_path, longest_file=10.0)
    cell.live(25.0, RUNNING, "run-1")
    cell.recorder.close()
    files = runs_of(tmp_path)
    assert [stamps(f, "task/state")[0] for f in files] == pytest.approx([0, 10, 20], abs=0.2)
    assert sum(len(stamps(f, "task/state")) for f in files) == 25 * 30
    assert Recording.open(files[2]).metadata["continues"] == files[1].name
    small = Cell(tmp_path / "small", largest_file=0.001)
    noise = random.Random(0)
    for _ in range(20):
        small.hear(topics.LOG.at("sim"), Log(message=noise.randbytes(50_000).hex()))
        small.live(0.5, RUNNING, "run-1")
    small.recorder.close()
    assert all(f.stat().st_size < 1.3e6 for f in runs_of(tmp_path / "small"))


def test_the_oldest_recordings_are_deleted_once_named_those_of_idle_cells_first(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    names = [f"2026-01-0{k}_00-00-00_a{'_idle' * (k > 3)}.mcap" for k in range(1, 6)]
    for name in (*names, "mine.mcap", "2026-notes.txt"):
        (tmp_path / name).write_bytes(bytes(4_000_000))
    cell = Cell(tmp_path, keep=0.01, start_up=30.0)
    cell.live(1.0)
    doomed = [names[3], names[4], names[0]]
    assert ", ".join(doomed) in caplog.text
    assert {p.name for p in tmp_path.iterdir()} >= {*names, "mine.mcap"}
    cell.live(31.0)
    cell.recorder.close()
    assert {p.name for p in tmp_path.iterdir()} >= {names[1], names[2], "mine.mcap"}
    assert not {p.name for p in tmp_path.iterdir()} & {*doomed}


def test_no_recording_is_deleted_unless_a_person_limits_their_size(tmp_path: Path):
    old = tmp_path / "2026-01-01_00-00-00_a.mcap"
    with old.open("wb") as stream:
        stream.truncate(2**40)
    cell = Cell(tmp_path)
    cell.live(35.0)
    cell.recorder.close()
    assert old.exists()


def test_a_limit_of_nothing_is_refused(tmp_path: Path):
    for keep in (0.0, -1.0, float("nan")):
        with pytest.raises(ConfigurationError, match="--keep"):
            Cell(tmp_path, keep=keep)


def test_recordings_of_a_run_with_a_star_stay(tmp_path: Path):
    first, second, third = (f"2026-01-0{k}_00-00-00_a.mcap" for k in (1, 2, 3))
    runs = RunFolder(tmp_path)
    for name, star in ((first, True), (second, False)):
        (tmp_path / name).write_bytes(bytes(4_000_000))
        runs.keep(RunFile(summary=RunSummary(id=name[:10], files=[name], star=star)))
    (tmp_path / third).write_bytes(bytes(4_000_000))
    (tmp_path / "runs" / "broken.json").write_text("{")
    cell = Cell(tmp_path, keep=0.01, start_up=30.0)
    cell.live(35.0)
    cell.recorder.close()
    assert [p.name for p in runs_of(tmp_path)[:2]] == [first, third]


def test_links_among_the_recordings_are_neither_counted_nor_deleted(tmp_path: Path):
    folder, elsewhere = tmp_path / "recordings", tmp_path / "large"
    folder.mkdir()
    with elsewhere.open("wb") as stream:
        stream.truncate(2**40)
    real, link, dangling = (folder / f"2026-01-0{k}_00-00-00_a.mcap" for k in (1, 2, 3))
    real.write_bytes(bytes(4_000_000))
    link.symlink_to(elsewhere)
    dangling.symlink_to(tmp_path / "missing")
    cell = Cell(folder, keep=0.01)
    cell.live(35.0)
    assert cell.states()[-1].recording
    cell.recorder.close()
    assert real.exists()
    assert link.is_symlink()
    assert dangling.is_symlink()
    assert elsewhere.exists()


def test_a_recording_that_cannot_be_deleted_does_not_stop_recording(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
):
    old = tmp_path / "2026-01-01_00-00-00_a.mcap"
    old.write_bytes(bytes(20_000_000))

    def refuse(path: Path) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(Path, "unlink", refuse)
    cell = Cell(tmp_path, keep=0.01, start_up=30.0)
    cell.live(35.0)
    assert cell.states()[-1].recording
    assert f"cannot delete {old}: Operation not permitted" in caplog.text


def test_a_long_pre_roll_is_written_over_several_steps(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(1.0)
    for _ in range(80):
        cell.hear(topics.LOG.at("sim"), Log(message="x" * 200_000))
    cell.live(1 / 30, RUNNING, "run-1")
    assert cell.recorder._files.writer is not None
    assert cell.recorder._files.writer.messages < 80
    cell.live(1.0, RUNNING, "run-1")
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    assert len(stamps(file, "log/sim")) == 80


IMAGE = CompressedImage(data=random.Random(0).randbytes(2**19))


def hear_images(cell: Cell, count: int) -> None:
    """Images, each with a state after it, that come between two steps."""
    for _ in range(count):
        cell.hear(topics.CAMERA_COLOR.at("overhead"), IMAGE)
        cell.hear(topics.ROPE_NODES, NodeChain(stamp=1))


def test_a_run_is_in_the_file_before_the_images_of_its_pre_roll(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(1.0)
    hear_images(cell, 120)
    cell.live(2 / 30, RUNNING, "run-1")
    (file,) = runs_of(tmp_path)
    entries = list(Recording(file).messages())
    states = [e.parse().state for e in entries if e.key == topics.TASK_STATE.key]
    # So much is left by a recorder that is killed now.
    assert states[-2:] == [RUNNING, RUNNING]
    images = topics.CAMERA_COLOR.at("overhead").key
    assert 0 < len(stamps(file, images)) < 60
    assert entries == sorted(entries, key=lambda entry: entry.log_time)
    cell.live(2.0, RUNNING, "run-1")
    cell.recorder.close()
    entries = list(Recording(file).messages())
    assert entries == sorted(entries, key=lambda entry: entry.log_time)
    assert [e.key for e in entries].count(images) == 120
    nodes = [e.sequence for e in entries if e.key == topics.ROPE_NODES.key]
    assert nodes == list(range(120))


def test_messages_that_no_reader_takes_begin_no_run(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0)
    cell.hear(topics.TASK_STATE, TaskState(state=RUNNING, run="r" * 5000))
    cell.hear(topics.TASK_STATE, TaskState(state=RUNNING, run="r", run_started=-(2**63)))
    cell.live(1.0)
    assert cell.states()[-1].run == ""
    cell.recorder.close()
    assert not runs_of(tmp_path)


def test_receipts_out_of_order_are_put_in_order(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0, RUNNING, "run-1")
    cell.now -= SECOND // 2
    cell.hear(topics.ROPE_NODES, NodeChain())
    cell.now += SECOND // 2
    cell.live(1.0, RUNNING, "run-1")
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    times = [e.log_time for e in Recording(file).messages()]
    assert len(times) >= 60
    assert times == sorted(times)


def test_a_recorder_that_lags_leaves_out_images_and_writes_every_state_at_once(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(1.0)
    cell.live(2.0, RUNNING, "run-1")
    hear_images(cell, 60)
    cell.now += 2 * SECOND
    cell.live(1 / 30, RUNNING, "run-1")
    (file,) = runs_of(tmp_path)
    assert len(stamps(file, topics.ROPE_NODES.key)) == 60
    written = len(stamps(file, topics.CAMERA_COLOR.at("overhead").key))
    assert 0 < written < 20
    cell.live(1.0, RUNNING, "run-1")
    assert cell.states()[-1].drops == 60 - written
    cell.recorder.close()


def test_the_later_a_step_of_the_recorder_the_fewer_images_it_writes(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(1.0)
    cell.live(2.0, RUNNING, "run-1")
    (file,) = runs_of(tmp_path)
    counts: list[int] = []
    for late in (0.1, 0.2, 0.8):
        cell.now += round(late * SECOND)
        hear_images(cell, 60)
        cell.said = []
        cell.live(1 / 30, RUNNING, "run-1")
        drawn = any(topic.key.startswith("view/") for topic, _ in cell.said)
        assert drawn == (late < 0.5)
        counts.append(len(stamps(file, topics.CAMERA_COLOR.at("overhead").key)) - sum(counts))
    assert counts == sorted(set(counts), reverse=True)
    assert counts[-1] > 0
    assert len(stamps(file, topics.ROPE_NODES.key)) == 180
    cell.live(2.0, RUNNING, "run-1")
    assert any(topic.key.startswith("view/") for topic, _ in cell.said)
    cell.recorder.close()


def test_images_of_a_pre_roll_are_written_whole_by_a_recorder_in_time(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0)
    cell.live(1.0)
    hear_images(cell, 120)
    cell.live(2.0, RUNNING, "run-1")
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    assert len(stamps(file, topics.CAMERA_COLOR.at("overhead").key)) == 120
    assert cell.states()[-1].drops == 0


def test_what_waits_at_the_end_is_saved_and_its_progress_is_logged(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
):
    caplog.set_level(logging.INFO)
    cell = Cell(tmp_path)
    cell.live(2.0, RUNNING, "run-1")
    hear_images(cell, 60)
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    assert len(stamps(file, topics.ROPE_NODES.key)) == 60
    lines = [r.getMessage() for r in caplog.records if "saving the recording" in r.getMessage()]
    assert len(lines) >= 3
    assert lines == sorted(lines, key=lambda line: -float(line.split()[3]))


def test_no_more_than_a_tenth_of_a_second_is_missing_where_the_recorder_is_killed(tmp_path: Path):
    cell = Cell(tmp_path, start_up=3.0)
    for seconds, state in ((2.9, IDLE), (2.5, IDLE), (2.0, RUNNING)):
        # The first file is a start's, the second of the idle cell, the third of a run.
        for _ in range(round(10 * seconds)):
            cell.hear(topics.ARM_COMMAND, ArmCommand(id="now"))
            cell.live(0.1, state, "run-1")
            newest = max(tmp_path.glob("*.mcap"), key=lambda path: path.stat().st_mtime_ns)
            last = max(stamps(newest, "arm/command"), default=None)
            if last is not None:
                assert (cell.now - NOW) / SECOND - last < 0.1 + 0.1 + 0.05


def test_an_idle_cell_is_recorded_like_a_run_on_request(tmp_path: Path):
    cell = Cell(tmp_path, start_up=0.0, always=True)
    for _ in range(10):
        cell.hear(topics.CAMERA_COLOR.at("overhead"), IMAGE)
        cell.live(1.0)
    cell.recorder.close()
    (file,) = tmp_path.glob("*.mcap")
    assert len(stamps(file, topics.CAMERA_COLOR.at("overhead").key)) == 10


def test_made_up_publishers_and_numbers_are_recorded(tmp_path: Path):
    cell = Cell(tmp_path, start_up=30.0)
    for k in range(5000):
        task = TaskState(state=IDLE).SerializeToString()
        message = heard("task/state", task, f"p-{k}", 10**17 + k, cell.now)
        cell.recorder.tap(message)
    cell.live(0.5)
    cell.recorder.close()
    (file,) = runs_of(tmp_path)
    assert len(stamps(file, "task/state")) == 5015


def test_a_run_is_on_the_disk_every_second(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    synced: list[int] = []
    sizes = lambda descriptor: synced.append(os.fstat(descriptor).st_size)  # noqa: E731
    monkeypatch.setattr(os, "fdatasync", sizes)
    cell = Cell(tmp_path)
    for k in range(5):
        cell.live(1.0, RUNNING, "run-1")
        # A sync that is due while the disk is busy with the one before is left out.
        until(lambda k=k: len(synced) >= k or cell.live(0.1, RUNNING, "run-1"), 10.0)
    assert synced == sorted(set(synced))
    cell.recorder.close()
    for thread in threading.enumerate():
        if thread.name.startswith("disk sync"):
            thread.join(5.0)
    assert synced[-1] == next(tmp_path.glob("*.mcap")).stat().st_size


def test_a_folder_that_cannot_be_written_is_reported_and_tried_again(tmp_path: Path, caplog):
    folder = tmp_path / "recordings"
    folder.write_text("a file where the folder should be")
    cell = Cell(tmp_path)
    cell.recorder = build(parse(TEXT, tmp_path), "r", RecorderOptions(folder))
    cell.live(1.0)
    assert not cell.states()[-1].recording
    assert str(folder) in cell.recorder.note
    assert "not recording" in caplog.text
    folder.unlink()
    cell.live(11.0)
    assert cell.states()[-1].recording
    assert cell.recorder.note == ""


def test_new_folder_of_recordings_is_for_its_owner_alone_and_an_old_one_stays(
    tmp_path: Path,
) -> None:
    old = tmp_path / "old"
    old.mkdir(0o755)
    for folder, mode in ((tmp_path / "new", 0o700), (old, 0o755)):
        service = build(parse(TEXT, tmp_path), "r", RecorderOptions(folder, least_free=0.0))
        service.warm_up()
        list(service.step(Inbox({}, {}), NOW))
        service.close()
        assert folder.stat().st_mode & 0o777 == mode


def test_recording_stops_before_the_disk_is_full(tmp_path: Path, monkeypatch):
    cell = Cell(tmp_path)
    cell.live(1.0)
    assert cell.states()[-1].recording
    full = shutil.disk_usage(tmp_path)._replace(free=0)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: full)
    cell.live(25.0)
    assert not cell.states()[-1].recording
    assert "make room" in cell.recorder.note
    # No attempt leaves another one behind.
    (file,) = tmp_path.glob("*.mcap")
    list(Recording(file).messages())


def test_a_folder_that_cannot_be_written_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    cell = Cell(tmp_path)

    def refuse(path: Path, *_: object, **__: object) -> None:
        raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(path))

    monkeypatch.setattr(run_files, "Writer", refuse)
    cell.live(25.0)
    assert not cell.states()[-1].recording
    reason = f"cannot record to {tmp_path}: Read-only file system"
    assert cell.recorder.note == reason
    assert [r.getMessage() for r in caplog.records].count(f"not recording: {reason}") == 1


def test_message_that_cannot_be_drawn_is_recorded_and_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = build(parse(TEXT, tmp_path), "recorder-0", RecorderOptions(tmp_path))

    def fail(*_: object) -> None:
        raise KeyError("x")

    monkeypatch.setattr(recorder._view, "take", fail)
    monkeypatch.setattr(recorder._view, "draw", fail)
    payload = TaskState(state=RUNNING, run="1").SerializeToString()
    recorder.tap(heard(topics.TASK_STATE.key, payload, "controller-0", 0, NOW))
    list(recorder.step(Inbox({}, {}), NOW))
    recorder.close()
    assert recorder.door.refused == 2
    (file,) = runs_of(tmp_path)
    assert [e.key for e in Recording(file).messages()] == [topics.TASK_STATE.key]


def test_longest_name_of_a_scenario_names_a_recording(tmp_path: Path) -> None:
    scenario = replace(parse(TEXT, tmp_path), name="x" * 100)
    recorder = build(scenario, "recorder-0", RecorderOptions(tmp_path, always=True))
    list(recorder.step(Inbox({}, {}), NOW))
    recorder.close()
    assert recorder.note == ""
    assert len(list(tmp_path.glob("*.mcap"))) == 1

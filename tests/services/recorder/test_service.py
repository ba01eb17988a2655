"""Recorder: one file for each run with every message, also when the disk is full."""

from __future__ import annotations

import shutil
from dataclasses import dataclass
from pathlib import Path

import pytest
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage

from services.recorder.options import RecorderOptions
from services.recorder.service import RecorderService, build
from shared import topics
from shared.messages import (
    FAILED,
    IDLE,
    REACHED,
    RUNNING,
    ArmState,
    ArmStates,
    NodeChain,
    Scene,
    TaskState,
    obstacle_message,
)
from shared.recording import Recording
from shared.scenario import parse
from shared.service import SECOND, Inbox

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


@dataclass(frozen=True)
class Heard:
    key: str
    payload: bytes
    publisher: str
    sequence: int
    received: int


class Cell:
    """Recorder with messages and a clock of the test's own."""

    def __init__(self, folder: Path, **options) -> None:
        scenario = parse(TEXT, folder)
        self.recorder: RecorderService = build(scenario, "r", RecorderOptions(folder, **options))
        self.now = NOW
        self.sequences: dict[str, int] = {}
        self.said: list = []

    def hear(self, topic, message, skip: int = 0) -> None:
        sequence = self.sequences.get(topic.key, 0) + skip
        self.sequences[topic.key] = sequence + 1
        self.recorder.tap(Heard(topic.key, message.SerializeToString(), "p-0", sequence, self.now))

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
    files = sorted(tmp_path.glob("*.mcap"))
    runs = []
    for file in files:
        states = [e.parse() for e in Recording(file).messages(["task/state"])]
        runs.append(list(dict.fromkeys((s.state, s.run) for s in states if s.state == RUNNING)))
        assert Recording.open(file).metadata["scenario"] == "three posts"
    # The idle rest after the last run is not kept.
    assert runs == [[(RUNNING, f"run-{k}")] for k in (1, 2, 3)]
    first = [e.parse() for e in Recording(files[0]).messages(["task/state"])]
    assert first[0].state == IDLE
    assert first[-1].state == REACHED
    assert files[0].name == "2026-05-28_20-26-40_three-posts.mcap"


def test_a_failed_run_ends_its_file_too(tmp_path: Path):
    cell = Cell(tmp_path)
    cell.live(1.0, RUNNING, "run-1")
    cell.live(3.0, FAILED, "run-1")
    assert [s.run for s in cell.states()][-1] == ""
    assert len(list(tmp_path.glob("*.mcap"))) == 2


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


def test_images_of_a_cell_that_idles_for_long_are_left_out(tmp_path: Path):
    cell = Cell(tmp_path)
    color = topics.CAMERA_COLOR.at("overhead")
    cell.live(1.0)
    cell.hear(color, CompressedImage(data=b"a"))
    cell.live(31.0)
    cell.hear(color, CompressedImage(data=b"b"))
    cell.live(1.0, RUNNING, "run-1")
    cell.hear(color, CompressedImage(data=b"c"))
    cell.recorder.close()
    (file,) = tmp_path.glob("*.mcap")
    images = [e.parse().data for e in Recording(file).messages([color.key])]
    assert images == [b"a", b"c"]


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


def test_the_drawing_shows_rope_obstacles_and_grippers(tmp_path: Path):
    cell = Cell(tmp_path)
    scenario = parse(TEXT, tmp_path)
    cell.hear(topics.ROPE_NODES, NodeChain(positions=[0, 0, 0, 0.1, 0, 0, 0.2, 0, 0.1]))
    cell.hear(topics.SCENE_STATE, Scene(obstacles=[obstacle_message(b) for b in scenario.bodies]))
    grips = scenario.grips(scenario.start)
    arms = [
        ArmState(arm=side, position=g.position, orientation=g.orientation)
        for side, g in zip(("left", "right"), grips, strict=True)
    ]
    cell.hear(topics.ARM_STATE, ArmStates(arms=arms))
    cell.live(0.1)
    drawing = [m for topic, m in cell.said if topic.key == "view/scene"][-1]
    entities = {e.id: e for e in drawing.entities}
    (line,) = entities["rope"].lines
    assert [(p.x, p.y, p.z) for p in line.points] == [(0, 0, 0), (0.1, 0, 0), (0.2, 0, 0.1)]
    assert line.thickness == pytest.approx(0.008)
    # The table, and the capsule as a cylinder between two caps.
    assert len(entities["obstacles"].cubes) == 1
    assert len(entities["obstacles"].cylinders) == 1
    assert [s.pose.position.z for s in entities["obstacles"].spheres] == pytest.approx([0.15, 0.25])
    left, right = entities["grippers"].cylinders
    # The grippers' bodies point away from the rope.
    assert left.pose.position.x == pytest.approx(-0.2 - scenario.limits.gripper_height / 2)
    assert right.pose.position.x == pytest.approx(0.2 + scenario.limits.gripper_height / 2)

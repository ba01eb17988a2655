from __future__ import annotations

from pathlib import Path

import pytest

from cli import show
from lariat.configuration import ConfigurationError
from lariat.scenario import Scenario, load
from lariat.trajectory import SECOND
from shared import topics
from shared.recording import Writer
from shared.topics import Topic
from tests.dashboard.stage import Stage

SCENARIO = load("scenarios/three-cylinders.toml")
START = 1_000 * SECOND


class Silent:
    """A service without a page, for a stage that is recorded."""

    name, rate, latency = "silent", 30.0, 0.0
    reads = writes = ()


class Recorded(Stage):
    """A stage whose messages go to a file."""

    def __init__(self, writer: Writer, scenario: Scenario) -> None:
        super().__init__(Silent(), scenario)  # pyright: ignore[reportArgumentType]
        self._writer = writer

    def send(self, topic: Topic, message: object) -> None:
        self._sequence += 1
        payload = message.SerializeToString(deterministic=True)  # pyright: ignore
        self._writer.write(topic, payload, "stage-0", self._sequence, self.now)


def record(path: Path, seconds: float = 4.0, scenario: Scenario = SCENARIO) -> Path:
    """A staged run as a recording."""
    writer = Writer(path, scenario, START)
    stage = Recorded(writer, scenario)
    steps = round(10.0 * seconds)
    for k in range(steps):
        stage.now = START + k * SECOND // 10
        stage.play((k + 1e-3) / steps)
        stage.picture()
    writer.close()
    return path


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return record(tmp_path_factory.mktemp("runs") / "run.mcap")


def test_recording_holds_what_the_page_shows(whole: Path) -> None:
    recording, timeline = show.open_timeline(whole)
    assert recording.damage == ""
    assert (timeline.start, timeline.end) == (START, START + 39 * SECOND // 10)
    inbox = timeline.jump(START + 2 * SECOND)
    assert inbox.latest(topics.TASK_STATE).message.run_started == START
    errors = [t.error for t in timeline.past(topics.TASK_STATE, timeline.end)]
    assert len(errors) == 40
    assert errors[-1] < 0.1 * errors[0]


def test_cut_recording_is_shown_up_to_the_cut(whole: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: 2 * whole.stat().st_size // 3])
    recording, timeline = show.open_timeline(cut)
    assert recording.damage
    assert START < timeline.end < START + 39 * SECOND // 10


def test_what_is_no_recording_is_refused_in_one_line(tmp_path: Path) -> None:
    other = tmp_path / "notes.mcap"
    other.write_text("not a recording")
    for file in (other, tmp_path / "missing.mcap"):
        with pytest.raises(ConfigurationError, match=file.name) as refused:
            show.open_timeline(file)
        assert "\n" not in str(refused.value)

"""Video of a recorded run, made by a process of its own."""

from __future__ import annotations

import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import cv2
import pytest

from lariat.scenario import load
from lariat.trajectory import SECOND
from services.recorder.runs.runs import Runs
from services.recorder.runs.video_process import PUBLISH_PERIOD, VideoProcess
from shared.door import Door
from shared.messages import RunListRequest, RunSummary, RunVideo

RECORDING = Path(__file__).parents[3] / "replay" / "three-cylinders.mcap"
SMALL = ("--settings.size", "160", "96", "--settings.rate", "2")
RUN = RunSummary(id="run-1", duration=2.8, over=True)


@pytest.fixture
def video() -> Iterator[VideoProcess]:
    made = VideoProcess(SMALL)
    yield made
    made.close()


def end_of(video: VideoProcess, seen: list[RunVideo] | None = None) -> RunVideo:
    """The message of the end, asked for in steps of a tenth of a second."""
    began = time.monotonic()
    for k in range(10_000):
        assert time.monotonic() - began < 60.0
        for publication in video.take(100 * SECOND + k * PUBLISH_PERIOD):
            message = publication.message
            assert isinstance(message, RunVideo)
            if seen is not None:
                seen.append(message)
            if message.data or message.failure:
                return message
        time.sleep(0.02)
    raise AssertionError("no end")


def test_video_is_published_once_it_is_made(video: VideoProcess, tmp_path: Path) -> None:
    seen: list[RunVideo] = []
    video.start(RUN, [RECORDING])
    message = end_of(video, seen)
    assert (message.run, message.progress, message.failure) == ("run-1", 1.0, "")
    (tmp_path / "run.mp4").write_bytes(message.data)
    capture = cv2.VideoCapture(str(tmp_path / "run.mp4"))
    # A second before and after the run, of 2.8 s.
    assert capture.get(cv2.CAP_PROP_FRAME_COUNT) == pytest.approx(10, abs=1)
    fractions = [m.progress for m in seen]
    assert fractions == sorted(fractions)
    assert any(0.0 < fraction < 1.0 for fraction in fractions)
    assert not list(video.take(0))


def test_progress_is_published_once_a_second(video: VideoProcess) -> None:
    video.start(RUN, [RECORDING])
    assert len(list(video.take(10 * SECOND))) == 1
    assert not list(video.take(11 * SECOND - 1))
    assert len(list(video.take(11 * SECOND))) == 1


def test_one_video_is_made_at_a_time_and_can_be_canceled(video: VideoProcess) -> None:
    video.start(RUN, [RECORDING])
    with pytest.raises(ValueError, match="run-1"):
        video.start(RunSummary(id="run-2"), [RECORDING])
    video.cancel()
    assert end_of(video).failure == "it was canceled"
    video.start(RunSummary(id="run-2"), [RECORDING])


def test_recording_that_cannot_be_read_names_the_reason(
    video: VideoProcess, tmp_path: Path
) -> None:
    (tmp_path / "bad.mcap").write_bytes(b"no recording")
    video.start(RUN, [tmp_path / "bad.mcap"])
    assert "bad.mcap" in end_of(video).failure


def test_long_run_is_refused_with_the_command_that_makes_its_video(video: VideoProcess) -> None:
    with pytest.raises(ValueError, match=r"601 s.*lariat export.*--to video"):
        video.start(RunSummary(id="run-1", duration=601.0), [RECORDING])


def test_request_reaches_the_recording_of_its_run(tmp_path: Path) -> None:
    runs = Runs(load("three-cylinders"), tmp_path, Door())
    shutil.copy(RECORDING, tmp_path)
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "run-1.json").write_text(
        '{"summary": {"id": "run-1", "over": true, "files": ["three-cylinders.mcap"]}}'
    )
    runs.load()
    request = RunListRequest(id="a-1", action=RunListRequest.MAKE_VIDEO, runs=["run-1"])
    cancel = RunListRequest(id="a-2", action=RunListRequest.CANCEL_VIDEO, runs=["run-1"])
    list(runs.step([request], "", 1))
    found: list[RunVideo] = []
    began = time.monotonic()
    while not any(m.failure for m in found):
        assert time.monotonic() - began < 20.0
        now = 10 * SECOND + round((time.monotonic() - began) * SECOND)
        messages = [p.message for p in runs.step([cancel], "", now)]
        found += [m for m in messages if isinstance(m, RunVideo)]
        time.sleep(0.02)
    assert found[-1].run == "run-1"
    runs.close()

"""Recorded run beside the present cell: what is shown at a time, and what is saved."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from dashboard.action_queue import ActionQueue
from dashboard.outbox import Outbox
from dashboard.panels.runs.opened_run import OpenedRun, marks_html
from dashboard.web.private_viser import PrivateViser
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import RunListRequest, RunMark, RunMotion, RunPicture

TIMES = [0.0, 0.5, 1.0]
SHAPES = np.arange(3.0)[:, None, None] + np.linspace(0.0, 0.1, 4)[None, :, None] * np.ones(3)


def motion(**fields: object) -> RunMotion:
    marks = [RunMark(time=0.0, text="start"), RunMark(time=1.0, text="reached: settled")]
    return RunMotion(
        run="run-1", node_count=4, time=TIMES, nodes=SHAPES.ravel(), marks=marks, **fields
    )


class Client:
    """Browser that keeps what it is sent."""

    def __init__(self) -> None:
        self.files: dict[str, bytes] = {}
        self.received = threading.Event()

    def send_file_download(self, name: str, content: bytes, save_immediately: bool) -> None:
        assert save_immediately
        self.files[name] = content
        self.received.set()


class Opened(OpenedRun):
    """An opened run whose requests are seen."""

    def __init__(self, private: PrivateViser) -> None:
        self.outbox = Outbox("test")
        scenario = load("three-cylinders")
        super().__init__(private.server, scenario, ActionQueue(), self.outbox)

    def asked(self, now: float = 0.0) -> list[tuple[int, float]]:
        self.update(round(now * SECOND))
        requests = [p.message for p in self.outbox.take(1) if p.topic == topics.RUN_LIST_REQUEST]
        return [(r.action, r.time) for r in requests]

    def shown(self) -> np.ndarray:
        assert self._rope._nodes is not None
        return np.array(self._rope._nodes.batched_positions)


@pytest.fixture
def opened() -> Iterator[Opened]:
    private = PrivateViser("test")
    try:
        yield Opened(private)
    finally:
        private.close()


def test_rope_and_picture_are_those_of_the_shown_time(opened: Opened) -> None:
    opened.open("run-1")
    assert opened.asked(1.0) == [(RunListRequest.SEND_MOTION, 0.0)]
    opened.take_motion(motion())
    assert opened.asked(2.0) == [(RunListRequest.SEND_PICTURE, 0.0)]
    np.testing.assert_allclose(opened.shown(), SHAPES[0], atol=1e-6)
    opened._take_bar(0.7)
    np.testing.assert_allclose(opened.shown(), SHAPES[1], atol=1e-6)
    # Not more often than four times in a second.
    assert opened.asked(2.1) == []
    assert opened.asked(2.3) == [(RunListRequest.SEND_PICTURE, 0.7)]


def test_time_bar_has_times_that_its_field_shows_whole(opened: Opened) -> None:
    opened.open("run-1")
    late = motion()
    late.time[:] = [0.026951, 0.5, 1.018273]
    opened.take_motion(late)
    assert opened._bar is not None
    assert (opened._bar.min, opened._bar.max, opened._bar.value) == (0.03, 1.02, 0.03)


def test_playback_ends_with_the_run(opened: Opened) -> None:
    opened.open("run-1")
    opened.take_motion(motion())
    opened.asked(1.0)
    opened._toggle()
    opened.asked(1.5)
    np.testing.assert_allclose(opened.shown(), SHAPES[1], atol=1e-6)
    opened.asked(5.0)
    np.testing.assert_allclose(opened.shown(), SHAPES[2], atol=1e-6)
    assert not opened._playing


def test_motion_of_another_run_is_not_shown(opened: Opened) -> None:
    opened.open("run-2")
    opened.take_motion(motion())
    assert opened._rope._nodes is None


def test_run_that_cannot_be_read_is_shown_by_its_reason_alone(opened: Opened) -> None:
    opened.open("run-1")
    reason = RunMark(text="cannot be read: <b>no recording</b>")
    opened.take_motion(RunMotion(run="run-1", marks=[reason]))
    opened.asked(1.0)
    opened._toggle()
    opened.asked(2.0)
    assert "<b>" not in marks_html(RunMotion(marks=[reason]))


def test_scene_and_picture_are_saved_as_files(opened: Opened) -> None:
    client = Client()
    opened.open("run-1")
    opened.take_motion(motion())
    data = cv2.imencode(".jpg", np.full((48, 64, 3), 90, np.uint8))[1].tobytes()
    opened.take_picture(RunPicture(run="run-1", data=data))
    opened._send_picture(client)
    assert client.files.pop("run-1-0.00s.png").startswith(b"\x89PNG")
    client.received.clear()
    opened._send_scene(client)
    assert client.received.wait(20.0)
    page = client.files["run-1.html"].decode()
    assert page.lstrip().lower().startswith("<!doctype html>")
    assert len(page) > 500_000
    # The scene goes on to show the time of the bar.
    np.testing.assert_allclose(opened.shown(), SHAPES[0], atol=1e-6)

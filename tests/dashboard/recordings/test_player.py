from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pytest

from dashboard.web.private_viser import PrivateViser
from dashboard.outbox import Outbox
from dashboard.page import Page
from dashboard.recordings.player import Player
from dashboard.recordings.timeline import RecordedMessage, Timeline
from dashboard.subscriptions import READS
from shared import topics
from shared.messages import RUNNING, NodeChain, TaskState
from lariat.scenario import load
from lariat.trajectory import SECOND

SCENARIO = load("scenarios/three-cylinders.toml")
NODES = np.linspace([0.0, 0.0, 0.3], [0.4, 0.0, 0.3], 40)


@contextmanager
def player() -> Iterator[Player]:
    """Ten seconds of a task, a message each second, at its start; the rope is seen after five."""
    messages = []
    for k in range(11):
        task = TaskState(stamp=k * SECOND, state=RUNNING, error=0.1)
        payload = task.SerializeToString()
        messages.append(RecordedMessage(topics.TASK_STATE.key, payload, "c", k, k * SECOND))
        if k == 5:
            payload = NodeChain(positions=NODES.ravel()).SerializeToString()
            messages.append(RecordedMessage(topics.ROPE_NODES.key, payload, "p", 0, k * SECOND))
    private = PrivateViser("test")
    page = Page(private.server, SCENARIO, Outbox("show"), live=False)
    try:
        yield Player(private.server, page, Timeline(messages, READS))
    finally:
        page.close()
        private.close()


def test_playing_takes_the_recordings_time_by_the_chosen_speed() -> None:
    with player() as shown:
        shown.step(0.1)
        assert shown.seconds == 0.0
        for _ in range(10):
            shown.step(0.1)
        assert shown.seconds == pytest.approx(1.0)
        shown.set_speed(5.0)
        shown.step(0.4)
        assert shown.seconds == pytest.approx(3.0)


def test_recording_stands_at_its_end_and_where_it_was_put() -> None:
    with player() as shown:
        shown.step(0.1)
        shown.step(60.0)
        assert shown.seconds == pytest.approx(10.0)
        shown.seek(4.5)
        shown.step(0.1)
        shown.step(0.1)
        assert shown.seconds == pytest.approx(4.5)
        shown.play(True)
        shown.step(0.1)
        assert shown.seconds == pytest.approx(4.6)
        shown.seek(-3.0)
        shown.step(0.1)
        assert shown.seconds == 0.0


def test_jump_back_shows_nothing_of_what_comes_later() -> None:
    with player() as shown:
        rope = shown._page._scene._rope
        for seconds, seen in ((7.0, True), (2.0, False), (6.0, True)):
            shown.seek(seconds)
            shown.step(0.1)
            assert rope.segments is not None
            assert rope.segments.visible == seen

from __future__ import annotations

from collections.abc import Iterator

import pytest

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls.run_controls import NUMBERS_PERIOD, RunControls
from dashboard.controls.status_text import StatusLine
from dashboard.outbox import Outbox
from dashboard.web.private_viser import PrivateViser


@pytest.fixture
def controls() -> Iterator[RunControls]:
    private = PrivateViser("test")
    yield RunControls(private.server.gui, ActionQueue(), Outbox("a"), live=True, resettable=True)
    private.close()


def line(text: str) -> StatusLine:
    return StatusLine(text, palette.BUSY)


def test_numbers_of_the_headline_change_at_a_readable_rate(controls: RunControls) -> None:
    now = 100 * NUMBERS_PERIOD
    controls.update(line("Running: 9 mm to go"), None, now)
    controls.update(line("Running: 8 mm to go"), None, now + NUMBERS_PERIOD // 2)
    assert "9 mm" in controls.headline.content
    controls.update(line("Running: 7 mm to go"), None, now + NUMBERS_PERIOD)
    assert "7 mm" in controls.headline.content
    # A jump back in a recording.
    controls.update(line("Running: 8 mm to go"), None, now)
    assert "8 mm" in controls.headline.content


def test_another_state_is_shown_at_once(controls: RunControls) -> None:
    now = 100 * NUMBERS_PERIOD
    controls.update(line("Running: 9 mm to go"), None, now)
    controls.update(line("Reached: 1 mm from the goal"), None, now + 1)
    assert "Reached" in controls.headline.content

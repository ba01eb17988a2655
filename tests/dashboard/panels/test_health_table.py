from __future__ import annotations

import pytest

from dashboard.panels import health_table
from shared.messages import Health, ProcessState, RecordState, StackState

WELL = Health(service="sim", period_ms=8.3, step_p50_ms=2.0, step_p99_ms=4.0)

PLANNING = Health(period_ms=100.0, step_p99_ms=900.0, longest_step_ms=10_000.0)
"""A service whose steps may be long, and that says so."""


@pytest.mark.parametrize(
    ("message", "age", "process", "word"),
    [
        (WELL, 0.5, "ready", "ok"),
        (WELL, 4.0, "ready", "frozen"),
        (WELL, 0.5, "frozen", "frozen"),
        (PLANNING, 4.0, "ready", "ok"),
        (PLANNING, 13.0, "ready", "frozen"),
        (None, 0.0, "ready", "ready"),
        (WELL, 4.0, "", "silent"),
        (WELL, 0.5, "dead", "dead"),
        (WELL, 4.0, "restarting", "restarting"),
        (None, 0.0, "", "not seen"),
        (Health(period_ms=8.3, step_p99_ms=9.0), 0.5, "ready", "slow"),
    ],
)
def test_state_follows_from_health_age_and_process(
    message: Health | None, age: float, process: str, word: str
) -> None:
    assert health_table.service_state(message, age, process).word == word


def test_table_shows_restarts_and_services_that_only_the_launcher_knows() -> None:
    stack = StackState(
        processes=[
            ProcessState(service="sim", state="ready", restarts=2),
            ProcessState(service="emulator", state="dead"),
        ]
    )
    page = health_table.table_html(["sim"], {"sim": (WELL, 0.2)}, stack)
    assert "×2" in page
    assert "emulator" in page
    assert "dead" in page
    assert "2.0 / 4.0" in page


def test_notes_cannot_become_markup() -> None:
    note = Health(service="sim", note="<b>x</b>")
    assert "<b>" not in health_table.table_html(["sim"], {"sim": (note, 0.0)}, None)


def test_recorder_says_what_the_recordings_take_and_what_the_disk_has_left() -> None:
    record = RecordState(file="a.mcap", recordings_size=3_210_000_000, free_space=120 * 10**9)
    assert all(w in health_table.recorder_html(record) for w in ("3.21 GB", "120 GB free"))
    assert "GB" not in health_table.recorder_html(RecordState(file="a.mcap"))

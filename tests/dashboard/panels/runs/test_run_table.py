from __future__ import annotations

import math

from dashboard.panels.runs.run_table import csv_text, detail_html, label, matching, table_html
from lariat.trajectory import SECOND
from shared.messages import RunSummary

RUN = RunSummary(
    id="a",
    scenario="rope",
    run="run-1",
    started=1_790_000_000 * SECOND,
    over=True,
    reached=True,
    error=0.0004,
    min_clearance=0.0123,
    duration=2.5,
    files=["a.mcap"],
    bytes=2_500_000,
    note="<script>",
)


def test_row_says_verdict_error_clearance_time_and_note() -> None:
    text = table_html([RUN], {"a"})
    for words in ("reached", "0.40 mm", "12.3 mm", "2.5 s", "&lt;script&gt;"):
        assert words in text
    assert "<script>" not in text


def test_runs_of_one_name_have_labels_of_their_own() -> None:
    later = RunSummary()
    later.CopyFrom(RUN)
    later.started += SECOND
    assert label(RUN) != label(later)


def test_detail_names_the_command_that_shows_the_recording_as_long_as_it_is_there() -> None:
    assert "lariat show recordings/a.mcap" in detail_html(RUN)
    gone = RunSummary()
    gone.CopyFrom(RUN)
    gone.bytes = 0
    assert "lariat show" not in detail_html(gone)
    assert "(deleted)" in detail_html(gone)


def test_csv_leaves_out_what_is_no_clearance() -> None:
    assert csv_text([0.0, 0.5], [0.1, 0.2], [-1.0, 0.03]).splitlines() == [
        "time [s],error [m],clearance [m]",
        "0.0000,0.1000000,",
        "0.5000,0.2000000,0.0300000",
    ]
    assert math.isfinite(float(csv_text([1.0], [2.0], [3.0]).split(",")[-1]))


def test_words_choose_among_runs_by_scenario_verdict_and_note() -> None:
    trial = RunSummary(
        scenario="rope", over=True, note="2026_rope: seed 3, control.clearance = 0.02"
    )
    assert matching([RUN, trial], "") == [RUN, trial]
    assert matching([RUN, trial], "2026_rope Seed") == [trial]
    assert matching([RUN, trial], "not reached") == [trial]
    assert matching([RUN, trial], "rope 0.4") == []

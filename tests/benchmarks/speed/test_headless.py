"""Time of a run by process."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.speed import headless
from lariat.scenario.settings import load_with


def test_processes_and_runner_share_the_whole_run() -> None:
    changes = ("sensing.source=truth", "run.time_limit=0.5")
    rows, title = headless.process_times(load_with(Path("twenty-posts"), changes))
    assert {row["process"] for row in rows} >= {"sim", "controller", "robot_gateway", "runner"}
    assert sum(row["share_percent"] for row in rows) == pytest.approx(100.0)
    assert all(row["ms_per_simulated_s"] > 0.0 for row in rows)
    assert title.startswith("twenty-posts: 0.")

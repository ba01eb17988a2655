"""Time of a run: by process, and of two clones in turn."""

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


def test_clones_run_in_turn_and_are_compared_by_their_medians(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    other, called = Path("/former"), []
    factors = iter([4.0, 2.0, 6.0, 3.0, 5.0, 2.5])

    def pace(clone: Path, scenario: str, changes: tuple[str, ...]) -> float:
        called.append(clone)
        return next(factors)

    monkeypatch.setattr(headless, "_real_time_factor", pace)
    ours, theirs = headless.paces("three-cylinders", (), other, 3)
    assert called == [headless.ROOT, other] * 3
    assert (ours["median"], theirs["median"], ours["ratio"]) == (5.0, 2.5, 2.0)

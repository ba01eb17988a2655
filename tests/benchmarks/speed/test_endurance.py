"""Endurance bench: trends are read from samples, runs are counted, an operation goes on."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.speed.endurance import Sample, sample_of, trends


def samples(memory: list[float]) -> list[Sample]:
    return [Sample("sim", 6.0 * k, mb, 10, 4, 36.0 * k, 2.0, 8.0) for k, mb in enumerate(memory)]


def test_growth_of_memory_is_the_slope_of_its_samples_without_the_first_tenth() -> None:
    (flat,) = trends(samples([50.0, *[100.0] * 19]))
    assert flat["memory_mb_per_hour"] == 0.0
    (growing,) = trends(samples([100.0 + k for k in range(20)]))
    assert growing["memory_mb_per_hour"] == pytest.approx(10.0)
    assert growing["memory_mb"] == (102.0, 119.0)


def test_load_is_the_processor_time_between_first_and_last_sample() -> None:
    (trend,) = trends(samples([100.0] * 20))
    assert trend["processor_percent"] == pytest.approx(10.0)
    assert (trend["step_p99_ms"], trend["period_ms"]) == ([2.0, 2.0], 8.0)


def test_sample_of_this_process_counts_its_open_files(tmp_path: Path) -> None:
    before = sample_of("me", None, 0.0)
    with (tmp_path / "a").open("w"), (tmp_path / "b").open("w"):
        during = sample_of("me", None, 0.0)
    assert during.files == before.files + 2
    assert before.threads >= 1
    assert before.memory_mb > 1.0

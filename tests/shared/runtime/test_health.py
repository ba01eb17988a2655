"""Health of a service, from the durations of its steps."""

from __future__ import annotations

import pytest

from shared.runtime.health import HealthMeter


def test_quantiles_of_step_times_are_steps_that_happened() -> None:
    meter = HealthMeter(0.010)
    for duration in range(1, 101):
        meter.add(duration * 1_000_000)
    report = meter.report({"arm/state": 4_000_000})
    assert report.step_p50_ms == pytest.approx(50.0)
    assert report.step_p99_ms == pytest.approx(99.0)
    assert report.step_max_ms == pytest.approx(100.0)
    assert report.overruns == 90
    assert report.input_age_ms["arm/state"] == pytest.approx(4.0)
    later = meter.report({})
    assert (later.steps, later.step_max_ms) == (100, 0.0)

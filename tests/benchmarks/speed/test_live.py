"""Step times of a live run, from the health in its recording."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from benchmarks.speed import live
from benchmarks.tables import PrintOptions
from lariat.configuration import ConfigurationError
from lariat.scenario import load
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import ArmStates, Health
from shared.recording import Recording, Writer

SCENARIO = load("three-cylinders")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """Eight seconds, of which the arms move in the last three; the first step warms up."""
    path = tmp_path / "run.mcap"
    writer = Writer(path, SCENARIO, 10 * SECOND)
    key = topics.HEALTH.at("controller")
    for k in range(8):
        for tick in range(8):
            now = (10 + k) * SECOND + tick * SECOND // 8
            mode = ArmStates.MOVING if k >= 5 else ArmStates.ARMED
            state = ArmStates(stamp=now, mode=mode).SerializeToString()
            writer.write(topics.ARM_STATE, state, "robot_gateway-0", 8 * k + tick, now)
        health = Health(
            service="controller",
            period_ms=20.0,
            step_p50_ms=500.0 if k == 0 else 6.0 if k >= 5 else 2.0,
            step_p99_ms=500.0 if k == 0 else 10.0 + k,
            step_max_ms=500.0 if k == 0 else 25.0,
            steps=50 * k,
            overruns=k,
            drops=7 + k,
        )
        at = (11 + k) * SECOND - 1
        writer.write(key, health.SerializeToString(), "controller-0", k, at)
    writer.close()
    return path


def test_step_times_are_medians_over_seconds_with_and_without_motion(file: Path) -> None:
    (controller,) = live.step_times(Recording.open(file))
    expected = {"service": "controller", "seconds": 8, "period_ms": 20.0, "p50_ms": 4.0}
    expected |= {"p50_moving_ms": 6.0, "p99_ms": 14.5, "max_ms": 500.0, "drops": 7}
    assert {name: controller[name] for name in expected} == expected
    assert controller["overruns"] == pytest.approx(7 / 350)


def test_bench_prints_one_object_and_refuses_a_recording_without_health(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert live.run(file, options=PrintOptions(json=True)) == 0
    assert json.loads(capsys.readouterr().out)["steps"][0]["p99_ms"] == 14.5
    assert live.run(file) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert all(word in said for word in ("MuJoCo", "n = 79", "model: 40", "camera"))
    empty = tmp_path / "empty.mcap"
    Writer(empty, SCENARIO, SECOND).close()
    with pytest.raises(ConfigurationError, match="holds no health"):
        live.run(empty)

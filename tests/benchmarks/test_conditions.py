from __future__ import annotations

from dataclasses import replace

from benchmarks.conditions import Conditions
from lariat.scenario import load

SCENARIO = load("scenarios/three-cylinders.toml")


def test_conditions_name_plant_sensing_and_adaptation() -> None:
    conditions = str(Conditions.of(SCENARIO))
    assert "MuJoCo, n = 118 (model: 40)" in conditions
    assert all(word in conditions for word in ("camera", "640 x 480", "1.5 mm"))
    assert "adapting: no" in conditions


def test_sensed_truth_is_told_from_the_camera() -> None:
    truth = replace(SCENARIO, sensing=replace(SCENARIO.sensing, source="truth"))
    assert Conditions.of(truth).sensed == "truth, node noise 0 mm"

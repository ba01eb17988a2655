"""Algorithm 2 shapes the paper's rod."""

from __future__ import annotations

import pytest

from benchmarks.paper.studies import ShapingSpec, Study, error_mm, run_trial


@pytest.mark.parametrize("study", [Study("actions", "xpbd"), Study("gauss_newton", "direct")])
def test_a_goal_behind_the_cylinders_is_reached_without_touching_them(study: Study) -> None:
    trial = run_trial(ShapingSpec(study, 0, 0, 300))
    assert trial["errors_mm"][0] > 200.0
    assert error_mm(trial) < 5.0
    assert trial["clearance_mm"] > 15.0


def test_adaptation_improves_the_prediction_of_a_softer_rope() -> None:
    errors = []
    for adapts in (False, True):
        study = Study("actions", "xpbd", softer=3.0, adapts=adapts)
        trial = run_trial(ShapingSpec(study, 0, 0, 100))
        errors.append(trial["prediction_mm"])
        assert bool(trial["parameters"]) == adapts
    assert errors[1] < 0.5 * errors[0]

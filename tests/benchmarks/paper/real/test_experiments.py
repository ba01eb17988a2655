from __future__ import annotations

import pytest

from benchmarks.paper.real.experiments import GOALS, ROPES, Experiment, experiments, scenario


@pytest.mark.parametrize("rope", ROPES)
def test_controller_believes_a_multiple_of_the_true_stiffness(rope: str) -> None:
    cell = scenario(Experiment(rope, 2, 4.0, adapt=False), (320, 240), 0.002, 5.0)
    assert cell.rope.youngs_modulus == pytest.approx(4.0 * cell.plant_rope.youngs_modulus)
    assert cell.sensing.source == "camera"
    assert cell.sensing.resolution == (320, 240)
    assert not cell.control.adapt


def test_every_rope_and_goal_runs_with_and_without_adaptation() -> None:
    todo = list(experiments((0.25, 4.0)))
    assert len(todo) == len(set(todo)) == len(ROPES) * len(GOALS) * 2 * 2

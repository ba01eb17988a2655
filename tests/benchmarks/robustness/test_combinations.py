from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from benchmarks.robustness.combinations import PLANTS, sample, scenarios_of_one_rope
from lariat.scenario import load

SCENARIOS = scenarios_of_one_rope()
COMBINATIONS = [sample(0, number, SCENARIOS) for number in range(60)]


def test_a_combination_is_the_same_for_the_same_seed_and_number() -> None:
    assert sample(3, 7) == sample(3, 7)
    assert sample(3, 7) != sample(4, 7)


def test_every_scenario_meets_every_plant() -> None:
    met = {(c.scenario, c.plant) for c in COMBINATIONS}
    assert met == {(name, plant) for name in SCENARIOS for plant in PLANTS}


def test_hidden_quantities_fill_their_ranges() -> None:
    ratios = [c.stiffness_ratio for c in COMBINATIONS]
    assert 0.25 <= min(ratios) < 0.35
    assert 2.8 < max(ratios) <= 4.0
    assert abs(np.mean(np.log(ratios))) < 0.3
    assert set(Counter(c.length_ratio for c in COMBINATIONS)) == {0.99, 1.01}
    assert {c.node_count for c in COMBINATIONS} == {120, 160}
    for combination in COMBINATIONS:
        np.testing.assert_allclose(np.linalg.norm(combination.offsets, axis=1), 0.003, atol=1e-5)


@pytest.mark.parametrize("combination", COMBINATIONS[:18], ids=str)
def test_only_ends_that_rotate_are_held_askew(combination) -> None:
    base = load(combination.scenario)
    for side, rotation in zip(("left", "right"), combination.rotations, strict=True):
        end = base.end(side)
        rotates = end.rotates or (combination.rotates and end.driver == "ideal")
        assert np.linalg.norm(rotation) == pytest.approx(2.0 if rotates else 0.0, abs=0.01)

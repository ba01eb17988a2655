"""Rods in hard cases, those of `lariat bench rod --part hard`."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.rod import hard_cases
from lariat.rod import Rod, RodProperties, RolloutSpec


def test_yanked_and_overlapping_rods_converge_or_report_failure() -> None:
    found = hard_cases.measure(60)
    assert found["finite"] == 60
    assert found["silently_wrong"] == 0
    assert found["gave_up"] <= 1


def test_a_roll_out_off_its_rest_length_reports_failure() -> None:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 10, tolerance=1e-7)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    assert rod.rollout(RolloutSpec(state, np.zeros((2, 2, 6)), 0.01)).failure is None
    actions = np.zeros((10, 2, 6))
    actions[:, 1, 0] = 0.5
    overstretched = rod.rollout(RolloutSpec(state, actions, 0.01))
    assert "rest length" in str(overstretched.failure)


def test_ends_further_apart_than_the_rod_is_long_are_refused() -> None:
    rod = Rod(RodProperties(0.45, 0.008, 0.044, 1e6), 10)
    state = rod.straight([0.0, 0.0, 0.3], [1.0, 0.0, 0.3])
    far = replace(state, positions=2.0 * state.positions)
    with pytest.raises(ValueError, match=r"0\.45 m"):
        rod.rollout(RolloutSpec(far, np.zeros((1, 2, 6)), 0.01))

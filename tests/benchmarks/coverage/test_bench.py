"""Trials of stated standard deviations, and the count of those that are true."""

from __future__ import annotations

import math

import numpy as np
import pytest

from benchmarks.coverage.bench import coverages
from benchmarks.coverage.trial import GRIP_OFFSET, GRIP_ROTATION, Stated, run_trial, sample


def test_trials_of_a_seed_are_the_same() -> None:
    specs = [sample(3, 7) for _ in range(2)]
    assert specs[0].stiffness_factor == specs[1].stiffness_factor
    assert np.array_equal(specs[0].errors.offsets, specs[1].errors.offsets)


def test_grips_are_off_by_their_errors() -> None:
    errors = sample(0, 0).errors
    assert np.linalg.norm(errors.offsets, axis=1) == pytest.approx([GRIP_OFFSET] * 2)
    assert np.linalg.norm(errors.rotations, axis=1) == pytest.approx([GRIP_ROTATION] * 2)


@pytest.mark.parametrize(("stated", "coverage"), [(1.0, 0.9), (0.5, 0.59), (2.0, 0.999)])
def test_coverage_is_that_of_normal_errors(stated: float, coverage: float) -> None:
    random = np.random.default_rng(0)
    trials = [[[Stated("length", e, stated)]] for e in random.normal(size=4000)]
    (row,) = coverages(trials)
    assert row.coverage == pytest.approx(coverage, abs=0.02)
    assert row.width_ratio == pytest.approx(stated, rel=0.05)
    assert row.true == (stated == 1.0)


def test_trial_states_the_stiffness_of_a_rope_that_is_unlike_its_model() -> None:
    spec = next(s for s in (sample(n, 0) for n in range(50)) if s.plant == "rod")
    stages = run_trial((spec, 0))
    (first,), (last,) = ([s for s in stages[k] if s.group == "stiffness"] for k in (0, -1))
    assert last.deviation < first.deviation < 1.0
    assert abs(last.error) < math.log(1.2)

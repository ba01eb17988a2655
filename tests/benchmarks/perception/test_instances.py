"""Judgement of detected ropes, and the fit of their doubt."""

from __future__ import annotations

import numpy as np

from benchmarks.perception.instances.calibration import fit_logistic
from benchmarks.perception.instances.judgement import dice_matrix


def test_dice_matrix_of_shifted_bars() -> None:
    truth, found = np.zeros((4, 40), np.uint8), np.zeros((4, 40), np.uint8)
    truth[0], truth[2] = 1, 2
    found[2, :30], found[3] = 1, 2
    assert np.allclose(dice_matrix(truth, found, 2, 2), [[0.0, 0.0], [60.0 / 70.0, 0.0]])


def test_logistic_fit_recovers_the_odds() -> None:
    random = np.random.default_rng(0)
    features = random.normal(size=(20_000, 2)) * [1.0, 5.0]
    odds = -0.5 + features @ [1.2, -0.1]
    wrong = random.random(20_000) < 1.0 / (1.0 + np.exp(-odds))
    assert np.allclose(fit_logistic(features, wrong), [-0.5, 1.2, -0.1], atol=0.06)

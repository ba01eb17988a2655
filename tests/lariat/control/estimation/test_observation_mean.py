"""Mean, weights and variance of observations of a rope at rest."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.estimation.observation_mean import MAX_OBSERVATIONS, ObservationMean

SIGMA = np.array([1e-3, 2e-3, 0.0])
SEEN = np.ones(3, dtype=bool)


def test_mean_of_few_observations_weighs_them_equally() -> None:
    random = np.random.default_rng(0)
    shapes = random.normal(size=(5, 3, 3))
    mean = ObservationMean()
    for nodes in shapes:
        mean.add(nodes, SIGMA, SEEN)
    assert mean.count == 5
    np.testing.assert_allclose(mean.nodes, shapes.mean(axis=0), rtol=1e-12)


def test_variance_without_motion_is_that_of_the_noise_over_the_count() -> None:
    mean = ObservationMean()
    for _ in range(4):
        mean.add(np.zeros((3, 3)), SIGMA, SEEN)
    np.testing.assert_allclose(mean.variance, SIGMA**2 / 4.0)


def test_spread_beyond_the_noise_is_not_reduced_by_averaging() -> None:
    swing = 0.01
    mean = ObservationMean()
    for k in range(20):
        mean.add(np.full((3, 3), swing * (-1.0) ** k), np.zeros(3), SEEN)
    # Values of plus and minus `swing` have a variance of swing^2.
    np.testing.assert_allclose(mean.variance, swing**2, rtol=0.02)


def test_nodes_that_are_not_seen_keep_their_mean() -> None:
    mean = ObservationMean()
    mean.add(np.zeros((3, 3)), SIGMA, np.array([True, True, False]))
    mean.add(np.ones((3, 3)), SIGMA, np.array([True, False, False]))
    np.testing.assert_allclose(mean.nodes[:, 0], [0.5, 0.0, 0.0])
    assert mean.observed.tolist() == [True, True, False]


def test_old_observations_fade() -> None:
    mean = ObservationMean()
    for _ in range(10 * MAX_OBSERVATIONS):
        mean.add(np.zeros((3, 3)), SIGMA, SEEN)
    mean.add(np.full((3, 3), 1e-3), SIGMA, SEEN)
    assert mean.nodes[0, 0] == pytest.approx(1e-3 / MAX_OBSERVATIONS)


def test_one_bad_image_hardly_moves_the_mean() -> None:
    mean = ObservationMean()
    for _ in range(10):
        mean.add(np.zeros((3, 3)), np.full(3, 1e-3), SEEN)
    mean.add(np.full((3, 3), 0.1), np.full(3, 1e-3), SEEN)
    assert np.all(np.linalg.norm(mean.nodes, axis=1) < 1e-3)

"""Posterior of unknowns from residuals and a prior."""

from __future__ import annotations

import numpy as np

from lariat.rod.identification import posterior

RANDOM = np.random.default_rng(0)
JACOBIAN = RANDOM.normal(size=(40, 3, 2))
TRUE_UNKNOWNS = np.array([0.3, -0.2])
NOISE = 0.05
ALL_FREE = np.array([True, True])


def solved(residuals: np.ndarray) -> np.ndarray:
    x = np.zeros(2)
    for _ in range(20):
        found = posterior.evidence(residuals - JACOBIAN @ x, JACOBIAN, NOISE, 1.0)
        x = x + posterior.gauss_newton_step(found, ALL_FREE)
    return x


def test_outliers_have_little_influence() -> None:
    residuals = JACOBIAN @ TRUE_UNKNOWNS + NOISE * RANDOM.normal(size=(40, 3))
    clean = solved(residuals)
    residuals[:4] += 100.0 * NOISE
    assert np.max(np.abs(clean - TRUE_UNKNOWNS)) < 0.02
    assert np.max(np.abs(solved(residuals) - clean)) < 0.03


def test_descent_is_the_negative_gradient_of_the_loss() -> None:
    residuals = JACOBIAN @ TRUE_UNKNOWNS + NOISE * RANDOM.normal(size=(40, 3))
    found = posterior.evidence(residuals, JACOBIAN, NOISE, 0.1)
    h = 1e-6
    for p in range(2):
        dx = h * np.eye(2)[p]
        costs = [
            posterior.loss(residuals - sign * JACOBIAN @ dx, NOISE, 0.1) for sign in (1.0, -1.0)
        ]
        np.testing.assert_allclose((costs[1] - costs[0]) / (2.0 * h), found.descent[p], rtol=1e-5)


def test_standard_deviations_are_those_of_repeated_experiments() -> None:
    solutions, claimed = [], []
    for _ in range(200):
        residuals = JACOBIAN @ TRUE_UNKNOWNS + NOISE * RANDOM.normal(size=(40, 3))
        solutions.append(solved(residuals))
        found = posterior.evidence(residuals - JACOBIAN @ solutions[-1], JACOBIAN, NOISE, 1.0)
        claimed.append(np.sqrt(np.diag(posterior.covariance(found, [], ALL_FREE))))
    ratio = np.std(solutions, axis=0) / np.mean(claimed, axis=0)
    assert np.all((ratio > 0.6) & (ratio < 1.4))


def test_clusters_that_disagree_widen_the_covariance() -> None:
    found = posterior.evidence(JACOBIAN @ TRUE_UNKNOWNS, JACOBIAN, NOISE, 1.0)
    alike = [found, found]
    opposed = [
        posterior.Evidence(found.information, found.descent * sign, 0.0) for sign in (2.0, -2.0)
    ]
    narrow = posterior.covariance(found, alike, ALL_FREE)
    wide = posterior.covariance(found, opposed, ALL_FREE)
    assert np.all(np.diag(wide) > 2.0 * np.diag(narrow))

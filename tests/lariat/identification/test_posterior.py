"""Posterior of unknowns from residuals and a prior."""

from __future__ import annotations

import math

import numpy as np
import pytest

from lariat.identification import posterior

RANDOM = np.random.default_rng(0)
JACOBIAN = RANDOM.normal(size=(40, 3, 2))
TRUE_UNKNOWNS = np.array([0.3, -0.2])
NOISE = 0.05
ALL_FREE = np.array([True, True])
NO_PRIOR = np.zeros((2, 2))


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
        claimed.append(np.sqrt(np.diag(posterior.covariance([found], NO_PRIOR, ALL_FREE))))
    ratio = np.std(solutions, axis=0) / np.mean(claimed, axis=0)
    assert np.all((ratio > 0.6) & (ratio < 1.4))


@pytest.mark.parametrize(("correlation", "assumed_share"), [(0.0, 0.02), (0.9, 1.0)])
def test_standard_deviations_do_not_depend_on_the_share_that_is_assumed_independent(
    correlation: float, assumed_share: float
) -> None:
    """Errors of 12 blocks of 50 points, correlated from point to point within a block."""
    random = np.random.default_rng(0)
    jacobian = random.normal(size=(12, 3, 2)).repeat(50, axis=0)
    solutions, claimed = [], []
    for _ in range(200):
        errors = random.normal(size=(12, 50, 3))
        for k in range(1, 50):
            fresh = math.sqrt(1.0 - correlation**2) * errors[:, k]
            errors[:, k] = correlation * errors[:, k - 1] + fresh
        residuals = jacobian @ TRUE_UNKNOWNS + NOISE * errors.reshape(-1, 3)
        solutions.append(np.linalg.lstsq(jacobian.reshape(-1, 2), residuals.ravel(), rcond=None)[0])
        left = (residuals - jacobian @ solutions[-1]).reshape(12, 50, 3)
        blocks = [
            posterior.evidence(r, j, NOISE, assumed_share)
            for r, j in zip(left, jacobian.reshape(12, 50, 3, 2), strict=True)
        ]
        covariance = posterior.covariance(blocks, NO_PRIOR, ALL_FREE)
        claimed.append(np.sqrt(np.diag(covariance)))
    ratio = np.std(solutions, axis=0) / np.mean(claimed, axis=0)
    assert np.all((ratio > 0.7) & (ratio < 1.4))


def test_unknown_that_is_not_seen_keeps_the_deviation_of_the_prior() -> None:
    jacobian = JACOBIAN * np.array([1.0, 0.0])
    blocks = [
        posterior.evidence(NOISE * RANDOM.normal(size=(10, 3)), jacobian[k : k + 10], NOISE, 1.0)
        for k in range(0, 40, 10)
    ]
    prior = np.diag([1e-6, 25.0])
    deviations = np.sqrt(np.diag(posterior.covariance(blocks, prior, ALL_FREE)))
    assert deviations[1] == pytest.approx(0.2)
    assert deviations[0] < 0.1


def test_standard_deviations_of_as_many_unknowns_as_blocks_are_not_too_small() -> None:
    """Each block draws the minimum to itself, so that its own errors show in part only."""
    random, unknowns = np.random.default_rng(0), 12
    jacobian = random.normal(size=(12, 4, 3, unknowns))
    solutions, claimed = [], []
    for _ in range(100):
        errors = NOISE * random.normal(size=(12, 4, 3))
        every = jacobian.reshape(-1, unknowns)
        solutions.append(np.linalg.lstsq(every, errors.ravel(), rcond=None)[0])
        left = errors - jacobian @ solutions[-1]
        blocks = [
            posterior.evidence(*pair, NOISE, 1.0) for pair in zip(left, jacobian, strict=True)
        ]
        covariance = posterior.covariance(blocks, 1e-9 * np.eye(unknowns), np.ones(unknowns, bool))
        claimed.append(np.sqrt(np.diag(covariance)))
    ratio = np.std(solutions, axis=0).mean() / np.mean(claimed)
    assert 0.8 < ratio < 1.1

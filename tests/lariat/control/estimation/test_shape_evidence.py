"""Weights of an observed shape, and the learnt size of all errors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.control.estimation.shape_evidence import (
    MODEL_ERROR_CORRELATION,
    ErrorScale,
    ShapeObservation,
    WhiteShape,
    whiten,
    with_own_value,
)
from lariat.identification.posterior import Evidence

COUNT = 20


def observation(residuals: Float64[np.ndarray, "n 3"]) -> ShapeObservation:
    """Straight rope along x, with one unknown that bends it."""
    places = np.linspace(0.0, 1.0, COUNT)
    jacobian = np.zeros((COUNT, 3, 1))
    jacobian[:, 2, 0] = np.sin(np.pi * places)
    used = np.ones(COUNT, dtype=bool)
    used[[0, -1]] = False
    return ShapeObservation(
        residuals,
        jacobian,
        np.full(COUNT, 1e-3),
        used,
        np.tile([1.0, 0.0, 0.0], (COUNT, 1)),
        2e-3,
        np.zeros(COUNT),
    )


def error_covariance() -> Float64[np.ndarray, "k k"]:
    """Covariance of the errors of the nodes that count."""
    places = np.linspace(0.0, 1.0, COUNT)[1:-1]
    apart = np.abs(places[:, None] - places) / MODEL_ERROR_CORRELATION
    return 4e-6 * np.exp(-apart) + 1e-6 * np.eye(COUNT - 2)


def test_shift_along_the_rope_is_no_evidence() -> None:
    along = np.zeros((COUNT, 3))
    along[:, 0] = 0.01
    assert not np.any(whiten(observation(along), 1.0).residuals)


def test_information_is_that_of_correlated_errors() -> None:
    shape = observation(np.zeros((COUNT, 3)))
    found = whiten(shape, 1.0).evidence.information
    slope = shape.jacobian[1:-1, 2, 0]
    expected = slope @ np.linalg.solve(error_covariance(), slope)
    assert found == pytest.approx(expected)


def test_errors_of_the_assumed_kind_are_white() -> None:
    random = np.random.default_rng(0)
    factor = np.linalg.cholesky(error_covariance())
    squares = []
    for _ in range(200):
        residuals = np.zeros((COUNT, 3))
        residuals[1:-1, 1:] = factor @ random.normal(size=(COUNT - 2, 2))
        squares.append(np.mean(whiten(observation(residuals), 1.0).residuals ** 2))
    assert np.mean(squares) == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("size", [0.5, 3.0])
def test_size_of_the_errors_is_learnt(size: float) -> None:
    random = np.random.default_rng(1)
    scale = ErrorScale(20.0)
    nothing, given = np.zeros(1), np.zeros((1, 1))
    for _ in range(30):
        errors = size / scale.factor * random.normal(size=36)
        shape = WhiteShape(errors, np.zeros((36, 1)))
        scale.take(shape, nothing, given)
        scale.keep()
    assert scale.factor == pytest.approx(size, rel=0.1)


def test_shape_that_is_taken_again_counts_once() -> None:
    scale, factors = ErrorScale(20.0), []
    for _ in range(5):
        shape = WhiteShape(np.full(36, 2.0 / scale.factor), np.zeros((36, 1)))
        scale.take(shape, np.zeros(1), np.zeros((1, 1)))
        factors.append(scale.factor)
    assert factors == pytest.approx([factors[0]] * 5)


def test_residual_that_the_unknowns_explain_is_no_error() -> None:
    shape = WhiteShape(np.full(36, 5.0), np.ones((36, 1)))
    scale = ErrorScale(20.0)
    scale.take(shape, np.full(1, 5.0), np.full((1, 1), 1.0 / 36.0))
    assert scale.factor < 1.0


def test_swing_of_the_whole_rope_tells_less_than_noise_of_its_nodes() -> None:
    still = observation(np.zeros((COUNT, 3)))
    swinging = replace(still, swing=np.full(COUNT, 5e-3))
    noisy = replace(still, deviations=np.full(COUNT, np.hypot(1e-3, 5e-3)))
    told = [whiten(shape, 1.0).evidence.information.item() for shape in (swinging, noisy, still)]
    assert told[0] < 0.5 * told[1] < told[2]


def test_an_unknown_with_its_own_value_in_a_shape_is_told_less_sharply_but_not_elsewhere() -> None:
    random = np.random.default_rng(0)
    root = random.normal(size=(9, 4))
    seen = Evidence(root.T @ root, random.normal(size=4), 1.0)
    told = with_own_value(seen, 1, 0.2)
    added = np.linalg.inv(told.information) - np.linalg.inv(seen.information)
    np.testing.assert_allclose(added, np.diag([0.0, 0.2**2, 0.0, 0.0]), atol=1e-12)
    steps = [np.linalg.solve(e.information, e.descent) for e in (seen, told)]
    np.testing.assert_allclose(*steps, atol=1e-12)

"""Fusion of the estimates of several cameras."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.perception.centerline.estimate import MAX_INCONSISTENCY, CenterlineEstimate
from lariat.perception.fusion import fuse

LINE = np.linspace([0.0, 0.0, 0.0], [0.4, 0.0, 0.0], 5)


def estimate(
    shift: float = 0.0,
    sigma: float = 1e-3,
    hidden: tuple[int, ...] = (),
    inconsistency: float = 0.0,
) -> CenterlineEstimate:
    observed = np.ones(len(LINE), bool)
    observed[list(hidden)] = False
    deviations = np.where(observed, sigma, 10.0 * sigma)
    return CenterlineEstimate(
        LINE + np.array([0.0, shift, 0.0]), deviations, observed, inconsistency=inconsistency
    )


def test_one_camera_is_left_as_it_is() -> None:
    only = estimate(hidden=(1,))
    assert fuse([only]) is only
    assert fuse([only, CenterlineEstimate.failed("no pixel")]) is only


def test_positions_are_weighted_by_their_inverse_variances() -> None:
    fused = fuse([estimate(0.0, 1e-3), estimate(1e-3, 2e-3)])
    np.testing.assert_allclose(fused.positions[:, 1], 0.2e-3)
    np.testing.assert_allclose(fused.sigma, (1e6 + 0.25e6) ** -0.5)


def test_a_node_that_one_camera_observes_is_taken_from_it_alone() -> None:
    fused = fuse([estimate(0.0, hidden=(2,)), estimate(2e-3, hidden=(0, 2))])
    assert fused.positions[0, 1] == 0.0
    assert fused.sigma[0] == pytest.approx(1e-3)
    assert fused.observed.tolist() == [True, True, False, True, True]


def test_interpolations_of_two_cameras_are_no_better_than_the_best_of_them() -> None:
    fused = fuse([estimate(hidden=(2,)), estimate(sigma=2e-3, hidden=(2,))])
    assert fused.sigma[2] == pytest.approx(10e-3)


def test_cameras_that_disagree_widen_the_standard_deviation_to_their_difference() -> None:
    fused = fuse([estimate(-5e-3), estimate(5e-3)])
    np.testing.assert_allclose(fused.positions[:, 1], 0.0, atol=1e-15)
    np.testing.assert_allclose(fused.sigma, 5e-3)


def test_deviations_of_honest_cameras_are_honest_after_the_fusion() -> None:
    rng = np.random.default_rng(3)
    errors, claimed = [], []
    for _ in range(400):
        noisy = [
            CenterlineEstimate(
                LINE + rng.normal(0.0, sigma / np.sqrt(3.0), LINE.shape),
                np.full(len(LINE), sigma),
                np.ones(len(LINE), bool),
            )
            for sigma in (1e-3, 1.5e-3)
        ]
        fused = fuse(noisy)
        errors.append(np.sum((fused.positions - LINE) ** 2, axis=1))
        claimed.append(fused.sigma**2)
    # Widening where they happen to disagree adds to it.
    assert 0.6 < np.mean(errors) / np.mean(claimed) < 1.0


def test_a_doubtful_estimate_counts_only_among_its_like() -> None:
    good, wrong = estimate(), estimate(0.1, inconsistency=2.0 * MAX_INCONSISTENCY)
    assert fuse([wrong, good]) is good
    assert fuse([wrong, wrong]).inconsistency > MAX_INCONSISTENCY


def test_all_reasons_are_named_when_no_camera_sees_the_rope() -> None:
    fused = fuse([CenterlineEstimate.failed("too dark"), CenterlineEstimate.failed("no depth")])
    assert fused.lost == "too dark; no depth"

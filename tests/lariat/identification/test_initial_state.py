"""Initial states are smooth chains through a few vertices."""

from __future__ import annotations

import numpy as np

from lariat.geometry import poses
from lariat.identification.initial_state import (
    batch_frames,
    cubic_spline,
    project_lengths,
    project_velocities,
)

SLACK_CHAIN = np.stack([np.linspace(0, 1, 12), 0 * np.arange(12.0), np.linspace(0, 1, 12) ** 2], 1)[
    None
]
MOVABLE = np.ones(12, dtype=bool)
MOVABLE[[0, 1, -1]] = False


def test_spline_goes_through_any_cubic() -> None:
    knots = np.array([0.0, 0.2, 0.5, 0.6, 1.0])

    def cubic(s: np.ndarray) -> np.ndarray:
        return np.stack([s**3 - s, 2.0 * s**2, 1.0 - s], axis=-1)

    tangents = np.array([[-1.0, 0.0, -1.0]]), np.array([[2.0, 4.0, -1.0]])
    at = np.linspace(0.0, 1.0, 23)
    found = cubic_spline(knots, cubic(knots)[None], *tangents, at)
    np.testing.assert_allclose(found[0], cubic(at), atol=1e-12)


def test_projected_chain_has_its_length_and_keeps_its_ends() -> None:
    edge = 1.04 * np.linalg.norm(np.diff(SLACK_CHAIN[0], axis=0), axis=1).mean()
    found = project_lengths(SLACK_CHAIN, edge, MOVABLE)
    lengths = np.linalg.norm(np.diff(found[0], axis=0), axis=1)[1:]
    np.testing.assert_allclose(lengths, edge, rtol=1e-6)
    np.testing.assert_array_equal(found[0, ~MOVABLE], SLACK_CHAIN[0, ~MOVABLE])


def test_projection_of_a_taut_chain_stays_finite() -> None:
    straight = np.stack([np.linspace(0, 1, 12), 0 * np.arange(12.0), 0 * np.arange(12.0)], 1)[None]
    found = project_lengths(straight, 0.9 / 11.0, MOVABLE)
    assert np.max(np.abs(found - straight)) < 0.5


def test_projected_velocities_keep_the_length_of_every_edge() -> None:
    random = np.random.default_rng(0)
    given = random.normal(size=SLACK_CHAIN.shape) * MOVABLE[:, None]
    kept = project_velocities(SLACK_CHAIN, given, MOVABLE)
    d = np.diff(SLACK_CHAIN, axis=1)
    rate = np.sum(d * np.diff(kept, axis=1), axis=2)[0, 1:]
    assert np.max(np.abs(rate)) < 1e-2 * np.max(np.abs(np.sum(d * np.diff(given, axis=1), axis=2)))
    np.testing.assert_allclose(project_velocities(SLACK_CHAIN, kept, MOVABLE), kept, atol=1e-2)


def test_frames_spread_the_twist_between_two_given_ones_evenly() -> None:
    z = np.array([0.0, 0.0, 1.0])
    tangents = poses.normalized(np.diff(SLACK_CHAIN, axis=1))
    first = poses.rotation_between(z, tangents[:, 0])
    last = poses.multiply(
        poses.rotation_between(z, tangents[:, -1]), poses.exponential(0.7 * z)[None]
    )
    frames = batch_frames(SLACK_CHAIN, first, last, (False, False))
    np.testing.assert_allclose(poses.rotate(frames, np.tile(z, (1, 11, 1))), tangents, atol=1e-12)
    np.testing.assert_allclose(np.abs(np.sum(frames[:, -1] * last)), 1.0, atol=1e-12)
    steps = poses.logarithm(poses.multiply(poses.conjugate(frames[:, :-1]), frames[:, 1:]))
    np.testing.assert_allclose(steps[0, :, 2], steps[0, 0, 2], rtol=5e-3)

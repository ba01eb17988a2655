"""Observed chains of a wrong length, laid along the model."""

from __future__ import annotations

import numpy as np

from services.controller.estimation.observation_registration import (
    GRIP_NODES,
    away_from_grips,
    registered_nodes,
)

COUNT, RADIUS = 40, 0.2


def arc(first: float, last: float) -> np.ndarray:
    """Chain on a circle between two angles [rad]."""
    angles = np.linspace(first, last, COUNT)
    return RADIUS * np.stack([np.cos(angles), np.sin(angles), np.zeros(COUNT)], axis=1)


def test_shift_along_the_rope_is_removed() -> None:
    model, seen = arc(0.0, 2.0), arc(0.01, 1.985)
    shifted = np.linalg.norm(seen - model, axis=1)[1:-1]
    left = np.linalg.norm(registered_nodes(seen, model, 2.0 * RADIUS) - model, axis=1)[1:-1]
    assert np.median(shifted) > 1e-3
    assert np.max(left) < 3e-5


def test_distance_across_the_rope_is_kept() -> None:
    model = arc(0.0, 2.0)
    seen = 1.02 * arc(0.005, 2.005)
    left = registered_nodes(seen, model, 2.0 * RADIUS) - model
    np.testing.assert_allclose(np.linalg.norm(left, axis=1)[1:-1], 0.02 * RADIUS, rtol=0.01)


def test_nodes_next_to_the_grips_are_not_observed() -> None:
    observed = np.ones(COUNT, dtype=bool)
    observed[20] = False
    away = away_from_grips(observed)
    assert observed.sum() - away.sum() == 2 * GRIP_NODES
    assert not away[20]
    assert not away[GRIP_NODES - 1]
    assert away[GRIP_NODES]

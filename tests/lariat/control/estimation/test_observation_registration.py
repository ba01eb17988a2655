"""Observed chains of a wrong length, laid along the model."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.estimation.observation_registration import (
    GRIP_DISTANCE,
    GRIP_SHARE,
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


@pytest.mark.parametrize(
    ("count", "length", "distance"),
    [(30, 0.45, GRIP_DISTANCE), (100, 0.45, GRIP_DISTANCE), (100, 2.0, 2.0 * GRIP_SHARE)],
)
def test_nodes_near_the_grips_are_not_observed_however_fine_the_rope_is(
    count: int, length: float, distance: float
) -> None:
    observed = np.ones(count, dtype=bool)
    observed[count // 2] = False
    away = away_from_grips(observed, length)
    places = np.linspace(0.0, length, count)
    near = np.minimum(places, length - places) < distance
    np.testing.assert_array_equal(away, observed & ~near)


def test_a_node_that_slides_along_an_arc_stays_on_it() -> None:
    model, seen = arc(0.0, 2.0), arc(0.04, 2.04)
    slid = registered_nodes(seen, model, 2.0 * RADIUS)[2:-2]
    np.testing.assert_allclose(np.linalg.norm(slid, axis=1), RADIUS, atol=2e-5 * RADIUS)

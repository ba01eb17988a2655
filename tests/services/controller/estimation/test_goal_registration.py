"""Goals laid along a rope whose length and place in the grips are known to a few millimetres."""

from __future__ import annotations

import numpy as np
import pytest

from services.controller.estimation.goal_registration import goal_along_rope

COUNT, RADIUS = 40, 0.1


def arc(first: float, last: float) -> np.ndarray:
    """Chain on a circle between two places along it [m]."""
    angles = np.linspace(first, last, COUNT) / RADIUS
    return RADIUS * np.stack([np.cos(angles), np.sin(angles), np.zeros(COUNT)], axis=1)


@pytest.mark.parametrize(("first", "last"), [(0.001, 0.301), (-0.002, 0.3), (0.0, 0.298)])
def test_goal_that_is_the_curve_of_the_rope_faces_its_nodes(first: float, last: float) -> None:
    goal, rope = arc(0.0, 0.3), arc(first, last)
    laid = goal_along_rope(goal, rope, last - first, 0.002)
    assert np.max(np.linalg.norm(goal - rope, axis=1)) > 9e-4
    assert np.max(np.linalg.norm(laid - rope, axis=1)[1:-1]) < 5e-5


def test_rope_beside_its_goal_stays_as_far_from_it() -> None:
    goal, rope = arc(0.0, 0.3), 1.05 * arc(0.001, 0.301)
    laid = goal_along_rope(goal, rope, 0.3, 0.002)
    apart = np.linalg.norm(laid - rope, axis=1)[1:-1]
    np.testing.assert_allclose(apart, 0.05 * RADIUS, rtol=0.02)


def test_goal_slides_no_further_than_the_rope_is_unsure() -> None:
    goal, rope = arc(0.0, 0.3), arc(0.01, 0.31)
    laid = goal_along_rope(goal, rope, 0.3, 0.002)
    slid = np.linalg.norm(laid - goal, axis=1)
    np.testing.assert_allclose(slid, 0.002, rtol=0.02)


def test_goal_of_a_known_rope_stays_where_it_is() -> None:
    goal, rope = arc(0.0, 0.3), arc(0.003, 0.303)
    length = float(np.sum(np.linalg.norm(np.diff(goal, axis=0), axis=1)))
    np.testing.assert_allclose(goal_along_rope(goal, rope, length, 0.0), goal, atol=1e-12)

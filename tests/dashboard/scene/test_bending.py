"""Colours of a rope by its curvature."""

from __future__ import annotations

import numpy as np
import pytest

from dashboard import palette
from dashboard.scene.bending import LEAST_RADIUS, bending_colors, curvatures


def circle(radius: float, count: int = 40) -> np.ndarray:
    angles = np.linspace(0.0, 2.0, count)
    return radius * np.stack([np.cos(angles), np.sin(angles), 0.0 * angles], axis=1)


def test_circle_has_the_curvature_of_its_radius() -> None:
    # A polygon of chords circumscribes a circle that is smaller by cos(2 / 39 / 2).
    assert curvatures(circle(0.25)) == pytest.approx(np.full(40, 4.0), rel=1e-3)


def test_straight_and_bent_ropes_have_the_colours_of_the_legend() -> None:
    straight = np.linspace(0.0, 1.0, 5)[:, None] * np.array([0.0, 1.0, 0.0])
    assert (bending_colors(straight) == palette.STRAIGHT).all()
    assert (bending_colors(circle(0.9 * LEAST_RADIUS)) == palette.BENT).all()
    half = bending_colors(circle(2.0 * LEAST_RADIUS, 400)).astype(float)
    middle = 0.5 * (np.array(palette.STRAIGHT) + np.array(palette.BENT))
    assert half == pytest.approx(np.tile(middle, (400, 1)), abs=1.0)


def test_folded_or_short_chain_has_finite_colours() -> None:
    folded = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.0, 0.0, 0.0]])
    assert (bending_colors(folded) == palette.BENT).all()
    assert (bending_colors(folded[:2]) == palette.STRAIGHT).all()

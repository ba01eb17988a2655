"""Stiffness of a cable is found from its shapes and its critical twist."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.identification.static_sag import (
    HangingShape,
    bending_stiffness,
    critical_twist,
    hang,
    twist_ratio,
)

EI, DENSITY = 8e-4, 0.027


@pytest.fixture(scope="module")
def shapes() -> list[HangingShape]:
    """Two measurements of a cable of 1.5 m that hangs in a loop between clamps 0.12 m apart."""
    t = np.linspace(0.0, 1.0, 400)[:, None]
    corners = np.array([[0.0, 0.0], [0.35, 0.0], [0.1, 1.3], [-0.22, 1.3], [-0.47, 0.0]])
    corners = np.concatenate([corners, [[-0.12, 0.0]]])
    weights = [1, 5, 10, 10, 5, 1]
    curve = sum(
        w * t**k * (1 - t) ** (5 - k) * c
        for k, (w, c) in enumerate(zip(weights, corners, strict=True))
    )
    span = np.array([-0.12, 0.0])
    drop = curve - t * span
    low, high, size = 0.1, 3.0, 1.0
    for _ in range(50):
        size = 0.5 * (low + high)
        longer = polylines.length(t * span + size * drop) > 1.5
        low, high = (low, size) if longer else (size, high)
    points = polylines.resample(np.pad(t * span + size * drop, ((0, 0), (0, 1))), 51)[:, :2]
    for _ in range(2):
        points = hang(HangingShape(points, DENSITY), EI).points
    noise = 1e-3 * np.random.default_rng(0).normal(size=(2, *points.shape))
    noise[:, [0, -1]] = 0.0
    return [HangingShape(points + n, DENSITY) for n in noise]


def test_stiffness_is_found_from_the_shape(shapes: list[HangingShape]) -> None:
    assert bending_stiffness(shapes[:1]) == pytest.approx(EI, rel=0.05)


def test_twist_ratio_is_found_from_the_jump(shapes: list[HangingShape]) -> None:
    jumps_at = critical_twist(hang(shapes[0], EI, 1.4))
    assert twist_ratio(shapes[0], EI, jumps_at) == pytest.approx(1.4, rel=0.02)

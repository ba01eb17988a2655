"""Fragments of ropes, and where their ends point to."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.perception.lines.fragments import Fragment, end_pose

WIDTH = 20.0


def fragment(points: np.ndarray) -> Fragment:
    return Fragment(points, (-1, -1), np.zeros(3), WIDTH / 2.0)


@pytest.mark.parametrize("side", [0, 1])
def test_end_of_an_arc_points_along_its_tangent_there(side: int) -> None:
    radius = 60.0
    angle = np.arange(0.0, 1.0, 1.0 / radius)
    # Whole pixels, as those of a skeleton.
    points = np.rint(radius * np.stack([np.sin(angle), 1.0 - np.cos(angle)], axis=1))
    pose = end_pose(fragment(points), side, WIDTH)
    at = angle[0] if side == 0 else angle[-1]
    tangent = np.array([np.cos(at), np.sin(at)]) * (-1.0 if side == 0 else 1.0)
    # Of the turning over the measured length, 0.83 rad, only a small part may be left.
    assert np.arccos(pose.outward @ tangent) < 0.2
    assert np.linalg.norm(pose.position - points[-side]) < 0.25 * 2.5 * WIDTH


def test_end_of_a_line_points_along_it() -> None:
    points = np.stack([np.arange(50.0), np.rint(0.3 * np.arange(50.0))], axis=1)
    pose = end_pose(fragment(points), 1, WIDTH)
    along = np.array([1.0, 0.3]) / np.hypot(1.0, 0.3)
    assert np.arccos(pose.outward @ along) < 0.05

"""Paths of the grips, which hold the rope's ends off their place."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from services.planner.problem import WholePath


def test_grips_lead_the_ends_along_their_path() -> None:
    random = np.random.default_rng(0)
    orientations = poses.normalized(random.normal(size=(5, 2, 4)))
    path = WholePath(
        0.02, random.normal(size=(5, 2, 3)), orientations, np.zeros((5, 8, 3)), True, "", 0.0, 0.1
    )
    ends = (
        Pose(np.array([0.003, -0.001, 0.002]), poses.exponential(np.array([0.03, 0.01, 0.0]))),
        Pose(np.array([0.0, 0.002, -0.004]), poses.exponential(np.array([0.0, -0.04, 0.02]))),
    )
    grips = path.of_grips(ends)
    for k in range(5):
        for side, end in enumerate(ends):
            led = Pose(grips.positions[k, side], grips.orientations[k, side]) @ end
            assert led.position == pytest.approx(path.positions[k, side])
            assert abs(led.orientation @ path.orientations[k, side]) == pytest.approx(1.0)

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose


@pytest.mark.parametrize("t", [0.0, 0.25, 1.0])
def test_interpolation_is_linear_in_position_and_in_the_angle_about_a_fixed_axis(t: float) -> None:
    axis = np.array([0.6, 0.0, 0.8])
    first = Pose(np.array([0.1, 0.2, 0.3]), poses.exponential(0.3 * axis))
    second = Pose(np.array([0.5, 0.2, -0.1]), poses.exponential(1.5 * axis))
    between = poses.interpolate(first, second, t)
    np.testing.assert_allclose(between.position, [0.1 + 0.4 * t, 0.2, 0.3 - 0.4 * t], atol=1e-15)
    rotation = poses.logarithm(between.orientation)
    np.testing.assert_allclose(rotation, (0.3 + 1.2 * t) * axis, atol=1e-12)

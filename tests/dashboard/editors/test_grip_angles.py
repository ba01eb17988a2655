from __future__ import annotations

import math

import numpy as np
import pytest

from dashboard.editors.grip_angles import grip_angles, grip_orientation
from lariat.geometry import poses
from lariat.scenario.goal_table import LEVEL_GRIP

Z = np.array([0.0, 0.0, 1.0])


def test_level_grip_along_x_has_no_angles() -> None:
    np.testing.assert_allclose(grip_angles(LEVEL_GRIP), 0.0, atol=1e-12)
    np.testing.assert_allclose(grip_orientation(np.zeros(3)), LEVEL_GRIP, atol=1e-12)


@pytest.mark.parametrize(
    ("yaw", "pitch", "direction"),
    [(90.0, 0.0, (0, 1, 0)), (0.0, 90.0, (0, 0, 1)), (180.0, -30.0, (-0.8660254, 0, -0.5))],
)
def test_rope_leaves_the_grip_in_the_named_direction(
    yaw: float, pitch: float, direction: tuple[float, float, float]
) -> None:
    q = grip_orientation(np.radians([yaw, pitch, 20.0]))
    np.testing.assert_allclose(poses.rotate(q, Z), direction, atol=1e-7)


def test_angles_lead_back_to_the_orientation_they_were_taken_from() -> None:
    rng = np.random.default_rng(5)
    for q in poses.normalized(rng.normal(size=(200, 4))):
        back = grip_orientation(grip_angles(q))
        assert abs(back @ q) == pytest.approx(1.0, abs=1e-12)


def test_vertical_rope_has_a_yaw_of_zero() -> None:
    q = grip_orientation(np.array([0.0, math.pi / 2, 0.7]))
    yaw, pitch, roll = grip_angles(q)
    assert (yaw, pitch) == (0.0, pytest.approx(math.pi / 2))
    assert roll == pytest.approx(0.7)

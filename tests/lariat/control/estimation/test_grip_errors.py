"""Motion of the rope's ends in grips that hold them off their place."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.control.estimation.grip_errors import GripErrors
from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.trajectory import MotionState, mean_twists

ERRORS = GripErrors(
    np.array([[0.003, -0.001, 0.002], [0.0, 0.002, -0.004]]),
    np.array([[0.03, 0.0, -0.02], [0.01, 0.04, 0.0]]),
)


def turning(time: float) -> MotionState:
    """Grips that translate and rotate at constant speed."""
    twists = np.array([[[0.1, 0.0, -0.2], [0.5, 0.3, 0.0]], [[0.0, 0.2, 0.1], [0.0, -0.4, 0.6]]])
    start = MotionState.at_rest(
        Pose(np.array([-0.2, 0.0, 0.3]), np.array([0.5, 0.5, 0.5, 0.5])),
        Pose(np.array([0.2, 0.1, 0.3]), poses.exponential(np.array([0.2, -0.7, 0.4]))),
    )
    return start.moved(time * twists, twists, np.zeros((2, 2, 3)))


def test_velocity_of_the_ends_is_the_derivative_of_their_poses() -> None:
    before, here, after = (ERRORS.held(turning(t)) for t in (-1e-5, 0.0, 1e-5))
    assert mean_twists(before, after, 2e-5) == pytest.approx(here.twists, abs=1e-8)


def test_ends_are_the_errors_in_the_frames_of_the_grips() -> None:
    grips = turning(0.1)
    held = ERRORS.held(grips)
    for k, (grip, end) in enumerate(zip(grips.grips, held.grips, strict=True)):
        relative = grip.inverse() @ end
        assert relative.position == pytest.approx(ERRORS.offsets[k])
        assert poses.logarithm(relative.orientation) == pytest.approx(ERRORS.rotations[k])


def test_exact_grips_hold_the_ends_themselves() -> None:
    assert GripErrors.none().held(turning(0.2)).positions == pytest.approx(turning(0.2).positions)

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.poses import Pose
from lariat.perception.tracking.motion_uncertainty import (
    HIDDEN_SHIFT,
    SHIFT_TIME,
    MotionUncertainty,
)

FRAME = 40_000_000
TURN = np.array([1.0, 0.0, 0.0, 0.0])


def at(x: float) -> Pose:
    return Pose(np.array([x, 0.0, 0.3]), TURN)


def middle(*places: float, start: int = 1, hidden: float = 0.0) -> float:
    """Standard deviation of the middle node after the right grip was at some places [m]."""
    motion, sigma = MotionUncertainty(), np.zeros(20)
    for number, x in enumerate(places):
        sigma = motion.take((at(0.0), at(x)), 20, (start + number) * FRAME, hidden)
    assert np.all(sigma[[0, 1, -2, -1]] == 0.0)
    assert np.ptp(sigma[2:-2]) == 0.0
    return float(sigma[10])


def test_grips_at_rest_add_nothing() -> None:
    assert middle(*5 * [0.4]) == 0.0


def test_it_is_proportional_to_the_speed_of_the_faster_grip() -> None:
    assert middle(0.40, 0.44) == pytest.approx(SHIFT_TIME * 1.0)
    assert middle(0.40, 0.48) == pytest.approx(SHIFT_TIME * 2.0)


def test_a_hidden_stretch_adds_to_it() -> None:
    assert middle(0.40, 0.40, hidden=0.1) == pytest.approx(0.1 * HIDDEN_SHIFT)
    assert middle(0.40, 0.48, hidden=0.1) > middle(0.40, 0.48)


def test_it_fades_after_a_stop() -> None:
    fading = [middle(0.40, 0.44, *n * [0.44]) for n in (0, 1, 10, 60)]
    assert fading == sorted(fading, reverse=True)
    assert fading[-1] < 0.02 * fading[0]


def test_unknown_grips_add_nothing() -> None:
    motion = MotionUncertainty()
    motion.take((None, None), 5, FRAME, 0.0)
    assert not np.any(motion.take((None, at(0.4)), 5, 2 * FRAME, 0.0))

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.narrow.trial import WaySpec, WayTrial, tip_errors


def _trial(clearance_mm: float, tip_angle: float, shape_error_mm: float) -> WayTrial:
    spec = WaySpec("posts", 2.0, 0, 0, 1.5, "rod")
    return WayTrial(
        spec, 3.0, [1.0], 9.0, clearance_mm, 0.1, tip_angle, shape_error_mm, 0, "reached"
    )


def test_a_trial_that_touches_or_ends_elsewhere_is_a_miss() -> None:
    assert not _trial(0.5, 0.01, 1.0).misses
    assert _trial(-0.1, 0.01, 1.0).misses == ["touched"]
    assert len(_trial(0.5, 0.06, 6.0).misses) == 2


def test_tips_that_are_turned_in_place_have_an_angle_only() -> None:
    goal = np.stack([np.linspace(0.0, 0.4, 9), np.zeros(9), np.zeros(9)], axis=1)
    turned = goal.copy()
    # The outermost edges of 50 mm are turned by 0.1 rad about the end nodes.
    turned[[1, -2], 2] = 0.05 * np.tan(0.1)
    position, angle = tip_errors(turned, goal)
    assert position == 0.0
    assert angle == pytest.approx(0.1)

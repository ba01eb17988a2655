"""What a trial measures: tips and shape."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.narrow.trial import at_goal, tip_errors


@pytest.mark.parametrize(
    ("errors", "good"),
    [
        ((0.001, 0.01, 0.001), True),
        ((0.011, 0.01, 0.001), False),
        ((0.001, 0.06, 0.001), False),
        ((0.001, 0.01, 0.006), False),
    ],
)
def test_tips_and_shape_must_be_at_the_goal(errors: tuple[float, float, float], good: bool) -> None:
    assert at_goal(*errors) == good


def test_tips_that_are_turned_in_place_have_an_angle_only() -> None:
    goal = np.stack([np.linspace(0.0, 0.4, 9), np.zeros(9), np.zeros(9)], axis=1)
    turned = goal.copy()
    # The outermost edges of 50 mm are turned by 0.1 rad about the end nodes.
    turned[[1, -2], 2] = 0.05 * np.tan(0.1)
    position, angle = tip_errors(turned, goal)
    assert position == 0.0
    assert angle == pytest.approx(0.1)

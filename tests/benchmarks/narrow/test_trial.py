"""What a trial measures: tips, shape, and clearance between the states of a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.narrow.trial import MeasuredWorld, at_goal, tip_errors
from lariat.geometry.poses import Pose
from lariat.scenario import load
from lariat.scenario.sections import Obstacle
from lariat.simulation.plants.end_motion import EndMotion


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


def test_a_bar_that_the_rope_jumps_over_counts() -> None:
    """Between two arm states the left end jumps from one side of the bar to the other."""
    base = load("three-cylinders")
    left, right = base.grips(base.start)
    x, y, z = left.position
    bar = Obstacle("box", (x, y + 0.1, z), size=(0.05, 0.01, 0.05), name="bar")
    world = MeasuredWorld(replace(base, obstacles=(bar,)))
    world.advance(EndMotion(left), EndMotion(right), 1)
    before = world.clearance
    shift = np.array([0.0, 0.2, 0.0])
    ends = [EndMotion(Pose(grip.position + shift, grip.orientation)) for grip in (left, right)]
    world.advance(ends[0], ends[1], 50_000_001)
    assert before > 0.05
    assert world.clearance == pytest.approx(-base.rope.diameter / 2.0 - 0.005, abs=0.006)

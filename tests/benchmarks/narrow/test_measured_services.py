from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.narrow.measured_services import MeasuredWorld
from lariat.geometry.poses import Pose
from lariat.scenario import load
from lariat.scenario.sections import Obstacle
from lariat.simulation.plants.end_motion import EndMotion


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

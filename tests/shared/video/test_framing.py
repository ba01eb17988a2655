"""Viewpoint from which a whole run is seen."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from shared.recording import Recording
from shared.video.framing import AZIMUTH, Rectangle, azimuth_of, frame, points_of
from shared.video.recorded_run import RecordedRun
from shared.video.video import AREA

SIZE = (480, 288)
REPLAY = Path(__file__).parents[2] / "replay"
CORNER: Rectangle = (0.7, 0.0, 1.0, 0.4)


def shares(points: np.ndarray, view) -> np.ndarray:
    pixels, depth = view.camera(SIZE).project(points)
    assert depth.min() > 0.0
    return pixels / SIZE


@pytest.mark.parametrize("name", ["three-cylinders", "rope"])
def test_a_run_fills_its_part_of_the_picture(name: str):
    run = RecordedRun(Recording.open(REPLAY / f"{name}.mcap"))
    points = points_of(run)
    view = frame(points, SIZE, azimuth_of(run), AREA)
    seen = shares(points, view)
    low, high = seen.min(0), seen.max(0)
    assert np.all(low >= AREA[:2])
    assert np.all(high <= AREA[2:])
    filled = (high - low) / np.subtract(AREA[2:], AREA[:2])
    assert filled.max() > 0.9
    # The run is in the middle of its part.
    middle = (np.array(AREA[:2]) + AREA[2:]) / 2.0
    assert (low + high) / 2.0 == pytest.approx(middle, abs=0.03)


def test_what_is_covered_leads_farther_away():
    points = np.random.default_rng(0).uniform((-0.3, -0.2, 0.0), (0.3, 0.2, 0.3), (400, 3))
    free = frame(points, SIZE, AZIMUTH, AREA)
    view = frame(points, SIZE, AZIMUTH, AREA, CORNER)
    assert view.distance > 1.05 * free.distance
    hidden = np.all((shares(points, view) >= CORNER[:2]) & (shares(points, view) <= CORNER[2:]), 1)
    assert not hidden.any()
    corner = np.all((shares(points, free) >= CORNER[:2]) & (shares(points, free) <= CORNER[2:]), 1)
    assert corner.any()


def test_a_single_arm_stands_behind_the_rope():
    single = RecordedRun(Recording.open(REPLAY / "rope.mcap"))
    view = frame(points_of(single), SIZE, azimuth_of(single), AREA)
    instant = single.at(0.0)
    arm = np.mean([body.position for body in instant.arms], axis=0)
    assert np.linalg.norm(arm - view.eye) > np.linalg.norm(instant.nodes.mean(0) - view.eye)
    without = RecordedRun(Recording.open(REPLAY / "three-cylinders.mcap"))
    assert azimuth_of(without) == AZIMUTH

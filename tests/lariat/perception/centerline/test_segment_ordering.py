from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.perception.centerline.gap_bridging import hidden_end_length, join_segments
from lariat.perception.centerline.segment_ordering import order_by_gaps, order_by_prior

ALONG_X = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
LENGTH = 0.4
LEFT, RIGHT = (Pose(np.array([x, 0.0, 0.2]), ALONG_X) for x in (0.0, LENGTH))


def segment(start: float, end: float) -> np.ndarray:
    """Points on the line from the left grip to the right one."""
    x = np.linspace(start, end, 40)
    return np.stack([x, 0.0 * x, 0.0 * x + 0.2], axis=1)


SEGMENTS = [segment(0.16, 0.28), segment(0.12, 0.02), segment(0.31, 0.39)]
"""Longest first; the second runs from right to left."""


def test_gaps_between_grips_order_and_flip_the_segments() -> None:
    best = order_by_gaps(SEGMENTS, LEFT, RIGHT, LENGTH)[0]
    assert best.indices == (1, 0, 2)
    assert best.flipped == (True, False, False)


def test_exchanged_grips_reverse_the_order() -> None:
    back = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([-1.0, 0.0, 0.0]))
    left, right = Pose(RIGHT.position, back), Pose(LEFT.position, back)
    best = order_by_gaps(SEGMENTS, left, right, LENGTH)[0]
    assert best.indices == (2, 0, 1)
    assert best.flipped == (True, True, False)


@pytest.mark.parametrize(("heading", "flipped"), [(-1.0, False), (1.0, True)])
def test_the_heading_of_a_grip_selects_between_equally_distant_ends(
    heading: float, flipped: bool
) -> None:
    y = np.linspace(-0.05, 0.05, 40)
    across = np.stack([0.0 * y + 0.05, y, 0.0 * y + 0.2], axis=1)
    turned = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([0.0, heading, 0.0]))
    grip = Pose(LEFT.position, turned)
    assert order_by_gaps([across], grip, None, LENGTH)[0].flipped == (flipped,)


def test_without_grips_the_left_end_has_the_smaller_x() -> None:
    assert order_by_gaps(SEGMENTS, None, None, LENGTH)[0].indices == (1, 0, 2)


def test_a_prior_leaves_out_segments_beyond_its_reach() -> None:
    prior = segment(0.0, LENGTH)[::4]
    far = segment(0.1, 0.2) + np.array([0.0, 0.1, 0.0])
    order = order_by_prior(prior, [*SEGMENTS, far], 0.03)
    assert order.indices == (1, 0, 2)
    assert order.flipped == (True, False, False)


def test_bridges_take_up_missing_length_and_keep_the_order() -> None:
    ordered = [SEGMENTS[1][::-1], SEGMENTS[0], SEGMENTS[2]]
    curve, places = join_segments(ordered, LEFT, RIGHT, 1.05 * LENGTH)
    length = np.sum(np.linalg.norm(np.diff(curve, axis=0), axis=1))
    assert LENGTH + 0.01 < length < 1.05 * LENGTH + 1e-6
    ends = np.concatenate([place[[0, -1]] for place in places])
    assert np.all(np.diff(ends) > 0.0)
    assert ends[0] > 0.0
    assert ends[-1] < 1.0


def test_hidden_length_is_shared_by_the_free_ends() -> None:
    ordered = [segment(0.1, 0.3)]
    assert abs(hidden_end_length(ordered, None, None, LENGTH) - 0.1) < 1e-9
    assert abs(hidden_end_length(ordered, LEFT, None, LENGTH) - 0.1) < 1e-9
    assert hidden_end_length(ordered, LEFT, RIGHT, LENGTH) == 0.0

"""The held rope is followed beside others of its colour, and those are told apart."""

from __future__ import annotations

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.obstacles import TABLE
from lariat.perception.centerline.estimate import CenterlineEstimate, OtherLine, ShapePrior
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.tracking.centerline_tracker import MAX_LEARNT_P_WRONG, CenterlineTracker
from lariat.rod import RodProperties
from lariat.simulation.camera.rgbd_camera import RGB, RgbdCamera, Tube
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips

WHITE: RGB = (255, 255, 255)
FRAMES = 6


def across(nodes: Float64[np.ndarray, "n 3"], heading: float, lift: float) -> Tube:
    """Straight rope of 0.5 m that crosses the middle of another."""
    middle = nodes[len(nodes) // 2]
    along = nodes[len(nodes) // 2 + 1] - nodes[len(nodes) // 2 - 1]
    yaw = np.arctan2(along[1], along[0]) + heading
    direction = np.array([np.cos(yaw), np.sin(yaw), 0.0])
    ends = [middle + s * 0.25 * direction + [0.0, 0.0, lift] for s in (-1.0, 1.0)]
    return Tube(polylines.resample(np.array(ends), 40), ROPE.radius, WHITE)


def followed(nodes: Float64[np.ndarray, "n 3"], *tubes: Tube) -> list[CenterlineEstimate]:
    """Estimates of a rope at rest in successive frames."""
    estimator = CenterlineEstimator(CAMERA, ROPE)
    tracker = CenterlineTracker(estimator, RodProperties(0.45, 0.008, 0.044, 1e6), [TABLE])
    camera = RgbdCamera(CAMERA, seed=1)
    found = []
    for k in range(FRAMES):
        frame = camera.take(nodes, ROPE.radius, [TABLE], frame=k, tubes=tubes)
        stamp = 1_000_000_000 + k * 33_000_000
        found.append(tracker.track(frame.color, frame.depth, *grips(nodes), stamp))
    return found


@pytest.mark.parametrize(("heading", "lift"), [(1.2, 0.02), (1.2, -0.02), (2.0, 0.009)])
def test_a_rope_of_the_same_colour_that_crosses_is_told_apart(heading: float, lift: float) -> None:
    nodes = curve(3, bend=0.6)
    other = across(nodes, heading, lift)
    for estimate in followed(nodes, other):
        errors = np.linalg.norm(estimate.positions - nodes, axis=1)
        assert np.mean(estimate.observed) > 0.6
        assert estimate.p_wrong < MAX_LEARNT_P_WRONG
        assert np.mean(errors[estimate.observed]) < 1e-3
        (line,) = estimate.others
        gaps = np.min(polylines.point_distances(line.points, other.nodes), axis=1)
        assert np.median(gaps) < 0.012
        assert polylines.length(polylines.resample(line.points, 20)) > 0.35


def test_a_rope_far_below_is_not_lifted_towards_ours_where_they_cross() -> None:
    nodes = curve(3, bend=0.6)
    other = across(nodes, 0.3, -0.06)
    for estimate in followed(nodes, other):
        assert estimate.others
        for line in estimate.others:
            assert np.max(polylines.least_distances(line.points, other.nodes)) < 0.01


def test_a_rope_that_lies_on_ours_in_the_image_is_followed_with_doubt_only() -> None:
    nodes = curve(3, bend=0.6)
    along = Tube(nodes + np.array([0.004, 0.004, 0.012]), ROPE.radius, WHITE)
    for estimate in followed(nodes, along):
        errors = np.linalg.norm(estimate.positions - nodes, axis=1)
        wrong = (errors > 0.01) & (errors > 3.0 * estimate.sigma)
        assert not np.any(wrong & estimate.observed)


def test_a_rope_that_is_known_to_lie_on_ours_does_not_draw_the_chain_to_it() -> None:
    nodes = curve(3, bend=0.6)
    along = Tube(nodes + np.array([0.004, 0.004, 0.012]), ROPE.radius, WHITE)
    frame = RgbdCamera(CAMERA, seed=1).take(nodes, ROPE.radius, [TABLE], frame=0, tubes=[along])
    points = polylines.resample(along.nodes, 150)
    line = OtherLine(CAMERA.project(points)[0], points)
    prior = ShapePrior(nodes, np.full(len(nodes), 0.004))
    estimator = CenterlineEstimator(CAMERA, ROPE)
    unknown, known = (
        estimator.estimate(frame.color, frame.depth, *grips(nodes), prior, expected_others=lines)
        for lines in ((), (line,))
    )
    errors = [np.mean(np.linalg.norm(e.positions - nodes, axis=1)) for e in (unknown, known)]
    assert errors[0] > 5e-3
    assert errors[1] < 1e-3
    assert not np.any(known.observed)


def test_a_rope_that_is_moved_under_another_is_not_taken_for_it() -> None:
    nodes = curve(3, bend=0.6)
    other = Tube(nodes + np.array([0.0, 0.003, 0.012]), ROPE.radius, WHITE)
    estimator = CenterlineEstimator(CAMERA, ROPE)
    tracker = CenterlineTracker(estimator, RodProperties(0.45, 0.008, 0.044, 1e6), [TABLE])
    camera = RgbdCamera(CAMERA, seed=1)
    errors, sigma = np.zeros(len(nodes)), np.zeros(len(nodes))
    for k in range(12):
        moved = nodes + np.array([0.0, 0.06 - 0.006 * min(k, 10), 0.0])
        frame = camera.take(moved, ROPE.radius, [TABLE], frame=k, tubes=[other])
        stamp = 1_000_000_000 + k * 33_000_000
        found = tracker.track(frame.color, frame.depth, *grips(moved), stamp)
        errors, sigma = np.linalg.norm(found.positions - moved, axis=1), found.sigma
        assert not np.any(errors[found.observed] > 5e-3)
    assert np.mean(errors) < 5e-3
    assert not np.any((errors > 0.01) & (errors > 3.0 * sigma))


def test_a_rope_alone_has_no_others() -> None:
    assert not any(estimate.others for estimate in followed(curve(3, bend=0.6)))


def test_a_gripper_of_the_rope_s_colour_is_no_other_rope() -> None:
    nodes = curve(3, bend=0.6)
    hand = Tube(nodes[-1] + np.array([[0.0, 0.0, 0.0], [0.06, 0.03, 0.02]]), 0.014, WHITE)
    assert not any(estimate.others for estimate in followed(nodes, hand))

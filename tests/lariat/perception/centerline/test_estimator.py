from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera, Intrinsics
from lariat.geometry.obstacles import TABLE
from lariat.perception.centerline.estimate import CenterlineEstimate, RopeDimensions, ShapePrior
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.perception.centerline.occlusion import occlusion_uncertainty
from lariat.perception.centerline.settings import CenterlineSettings
from lariat.simulation.camera.rgbd_camera import RgbdCamera
from lariat.simulation.camera.sensor_noise import SensorNoise
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips, screen, taken

CABLE = RopeDimensions(length=0.55, radius=0.0025, node_count=40)


def errors(estimate: CenterlineEstimate, nodes: np.ndarray) -> np.ndarray:
    assert estimate.lost == ""
    return np.linalg.norm(estimate.positions - nodes, axis=1)


@pytest.mark.parametrize("rope", [ROPE, CABLE], ids=["rope", "cable"])
def test_mean_node_error_is_below_half_a_millimetre(rope: RopeDimensions) -> None:
    estimator = CenterlineEstimator(CAMERA, rope)
    found = []
    for seed in range(8):
        nodes = curve(seed, rope)
        frame = taken(nodes, rope=rope, frame=seed)
        estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes))
        found.append(errors(estimate, nodes))
        assert np.mean(estimate.observed) > 0.95
    assert np.mean(found) < 0.5e-3
    assert np.max(np.mean(found, axis=1)) < 1.0e-3


def test_nodes_of_a_coarse_chain_lie_on_a_smooth_rope() -> None:
    """Edges that are fitted to an arc meet outside it, by a twelfth of their second difference."""
    estimator, fine = CenterlineEstimator(CAMERA, ROPE), replace(ROPE, node_count=291)
    outside, expected = [], []
    for seed in range(6):
        smooth = curve(seed, fine, bend=2.0)
        nodes, frame = smooth[::10], taken(smooth, rope=fine, frame=seed)
        estimate = estimator.estimate(frame.color, frame.depth, *grips(smooth))
        bend = np.diff(nodes, 2, axis=0)[3:-3]
        size = np.linalg.norm(bend, axis=1)
        miss = (estimate.positions - nodes)[4:-4]
        # Weighted with the curvature, the noise of straight parts does not count.
        outside.append(-np.sum(miss * bend) / np.sum(size))
        expected.append(np.sum(size**2) / 12.0 / np.sum(size))
    assert np.median(expected) > 1.5e-4
    assert abs(np.median(outside)) < 0.4 * np.median(expected)


def test_sigma_matches_the_error() -> None:
    estimator = CenterlineEstimator(CAMERA, ROPE)
    ratios = []
    for seed in range(8):
        nodes = curve(seed)
        frame = taken(nodes, frame=seed)
        estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes))
        ratios.append(errors(estimate, nodes)[2:-2] / estimate.sigma[2:-2])
    assert np.mean(np.array(ratios) < 2.0) > 0.9
    # A sigma that is much too large would pass the line above.
    assert np.median(ratios) > 0.3


def test_sigma_grows_with_the_noise_of_the_sensor() -> None:
    estimator, nodes = CenterlineEstimator(CAMERA, ROPE), curve(3)
    quiet, noisy = (
        estimator.estimate(frame.color, frame.depth, *grips(nodes)).sigma[2:-2]
        for frame in (taken(nodes, noise=SensorNoise(depth_sigma=s)) for s in (0.001, 0.006))
    )
    assert np.median(noisy) > 1.5 * np.median(quiet)


def test_the_chain_has_the_length_of_the_rope() -> None:
    nodes = curve(3)
    frame = taken(nodes, noise=SensorNoise(depth_sigma=0.003))
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth, *grips(nodes))
    assert polylines.length(estimate.positions) == pytest.approx(ROPE.length, rel=2e-3)


def test_a_hidden_third_is_interpolated_and_not_observed() -> None:
    estimator = CenterlineEstimator(CAMERA, ROPE)
    for seed in range(4):
        nodes = curve(seed, bend=0.7)
        frame = taken(nodes, (screen(nodes, 10, 19),))
        estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes))
        error = errors(estimate, nodes)
        assert not np.any(estimate.observed[12:18])
        assert np.all(estimate.observed[2:8])
        assert np.median(error) < 2e-3
        # A quarter of the rope is bridged: its middle lies off the chord by 10 to 50 mm.
        assert np.max(error[11:19]) < 0.008
        assert np.all(estimate.sigma[13:17] > 2.0 * np.median(estimate.sigma[2:8]))


def test_sigma_of_hidden_nodes_covers_other_shapes_whatever_the_prior_claims() -> None:
    estimator, edge = CenterlineEstimator(CAMERA, ROPE), ROPE.length / (ROPE.node_count - 1)
    for seed in range(3):
        nodes = curve(seed, bend=2.0)
        frame = taken(nodes, (screen(nodes, 9, 20),))
        prior = ShapePrior(nodes, np.full(len(nodes), 3e-4))
        estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes), prior)
        others = occlusion_uncertainty(
            estimate.positions, edge, estimate.observed, gripped=(True, True)
        )
        assert np.max(others) > 0.0015
        assert np.all(estimate.sigma >= 0.95 * others)


def test_a_prior_determines_hidden_nodes() -> None:
    estimator = CenterlineEstimator(CAMERA, ROPE)
    nodes = curve(5)
    frame = taken(nodes, (screen(nodes, 9, 20),))
    expected = ShapePrior(nodes + 0.001, np.full(len(nodes), 0.002))
    estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes), expected)
    assert np.max(errors(estimate, nodes)) < 3e-3


def test_sigma_of_hidden_nodes_covers_the_error_of_a_wrong_prior() -> None:
    estimator = CenterlineEstimator(CAMERA, ROPE)
    nodes = curve(5)
    frame = taken(nodes, (screen(nodes, 9, 20),))
    expected = ShapePrior(nodes + 0.02, np.full(len(nodes), 0.02))
    estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes), expected)
    assert np.all(~estimate.observed[12:18])
    assert np.all(errors(estimate, nodes) < 3.0 * estimate.sigma + 1e-3)


def test_a_rope_without_grips_is_estimated() -> None:
    nodes = curve(2)
    frame = taken(nodes)
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth)
    assert np.mean(errors(estimate, nodes)) < 4e-3


def test_a_dark_image_is_lost() -> None:
    black = np.zeros((480, 640, 3), np.uint8)
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(
        black, np.full((480, 640), 900, np.uint16)
    )
    assert "128" in estimate.lost
    assert estimate.positions.shape == (0, 3)


def test_a_dim_image_suggests_a_lower_threshold() -> None:
    frame = taken(curve(1), noise=SensorNoise(exposure=0.45))
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth)
    assert "lower sensing.threshold" in estimate.lost
    settings = CenterlineSettings(threshold=60)
    estimate = CenterlineEstimator(CAMERA, ROPE, settings).estimate(frame.color, frame.depth)
    assert np.mean(errors(estimate, curve(1))) < 4e-3


def test_a_bright_table_suggests_a_rope_colour() -> None:
    for table in ((140, 140, 140), (200, 195, 180)):
        camera = RgbdCamera(CAMERA, seed=1)
        frame = camera.take(curve(1), ROPE.radius, (TABLE,), [table])
        estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth)
        assert "sensing.rope_color" in estimate.lost


def test_an_image_without_depth_is_lost() -> None:
    frame = taken(curve(1))
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, 0 * frame.depth)
    assert "no depth" in estimate.lost


def test_an_image_of_another_size_is_lost() -> None:
    small = Camera(Intrinsics.symmetric(320, 240, math.radians(65.0)), CAMERA.T_world_camera)
    frame = taken(curve(1))
    estimate = CenterlineEstimator(small, ROPE).estimate(frame.color, frame.depth)
    assert "320 x 240" in estimate.lost


def test_a_short_piece_of_rope_is_lost() -> None:
    nodes = curve(1)
    frame = taken(nodes[:3])
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth)
    assert "only" in estimate.lost


def test_the_same_frame_gives_the_same_bits() -> None:
    nodes = curve(4)
    frame = taken(nodes)
    runs = [
        CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth, *grips(nodes))
        for _ in range(2)
    ]
    assert runs[0].positions.tobytes() == runs[1].positions.tobytes()


def alpha() -> np.ndarray:
    """Nodes of a loop whose strands cross at a right angle, 15 mm above each other [m]."""
    t = np.linspace(-2.2, 2.2, 3000)
    path = np.stack([t**3 - 3.0 * t, t**2, 0.08 * t], axis=1)
    path *= ROPE.length / polylines.length(path)
    nodes = polylines.resample(path, ROPE.node_count)
    nodes *= ROPE.length / polylines.length(nodes)
    return nodes - nodes.mean(axis=0) + np.array([0.0, 0.0, 0.25])


def fold(depth: float) -> np.ndarray:
    """Nodes of a rope that goes down and back up [m]; from above, its strands nearly coincide."""
    t = np.linspace(-1.0, 1.0, 3000)
    path = np.stack([0.12 * t, 0.01 * t, depth * (np.abs(t) ** 1.5 - 1.0)], axis=1)
    path *= ROPE.length / polylines.length(path)
    nodes = polylines.resample(path, ROPE.node_count)
    nodes *= ROPE.length / polylines.length(nodes)
    return nodes - nodes.mean(axis=0) + np.array([0.0, 0.0, 0.3])


def test_a_loop_is_estimated_through_its_crossing() -> None:
    nodes = alpha()
    frame = taken(nodes)
    estimate = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth, *grips(nodes))
    assert np.max(errors(estimate, nodes)) < 3e-3
    assert estimate.inconsistency < 0.1


@pytest.mark.parametrize("nodes", [alpha(), *(fold(d) for d in (0.1, 0.2, 0.4))])
def test_errors_above_a_centimetre_have_a_large_sigma_with_any_prior(nodes: np.ndarray) -> None:
    estimator = CenterlineEstimator(CAMERA, ROPE)
    frame = taken(nodes)
    straight = np.linspace(nodes[0], nodes[-1], len(nodes))
    for expected in (None, ShapePrior(straight, np.full(len(nodes), 0.05))):
        estimate = estimator.estimate(frame.color, frame.depth, *grips(nodes), expected)
        error = errors(estimate, nodes)
        assert not np.any((error > 0.010) & (error > 3.0 * estimate.sigma))


def test_a_second_rope_beside_a_tracked_one_is_ignored() -> None:
    nodes = curve(2, bend=0.6)
    other = nodes + np.array([0.02, 0.12, 0.0])
    first, second = taken(nodes), taken(other)
    color = np.maximum(first.color, second.color)
    depth = np.where(second.color[..., 0] > 128, second.depth, first.depth)
    estimator = CenterlineEstimator(CAMERA, ROPE)
    expected = ShapePrior(nodes + 0.002, np.full(len(nodes), 0.005))
    estimate = estimator.estimate(color, depth, *grips(nodes), expected)
    assert np.mean(errors(estimate, nodes)) < 1e-3
    assert np.mean(estimate.observed) > 0.95

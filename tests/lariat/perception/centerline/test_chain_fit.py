from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines, poses
from lariat.perception.centerline.bandwidth import BANDWIDTH, MARGIN
from lariat.perception.centerline.chain_fit import ChainFit, Fit
from tests.services.perception.scenes import CAMERA, ROPE, curve

EYE = CAMERA.T_world_camera.position
RANGE_SIGMA, RAY_SIGMA = 0.0015, 0.0006


def samples(points: np.ndarray, ranged: bool, noise: float = 0.0) -> np.ndarray:
    """Rows of `kernels.fit.fit` for points on the axis, with or without their ranges."""
    rays = points - EYE
    distance = np.linalg.norm(rays, axis=1)
    rows = np.zeros((len(points), 6))
    rows[:, :3] = poses.normalized(rays)
    if ranged:
        random = np.random.default_rng(0)
        rows[:, 3] = distance - ROPE.radius + noise * random.normal(size=len(points))
        rows[:, 4], rows[:, 5] = ROPE.radius, RANGE_SIGMA
    else:
        rows[:, 5] = RAY_SIGMA
    return rows


def fitted(
    nodes: np.ndarray,
    part: slice = slice(None),
    noise: float = 0.0,
    length: float = ROPE.length,
    *,
    length_ratio: float = 1.0,
    free_length: bool = False,
) -> Fit:
    """Fit to rays and ranges of part of a chain, from a start that is 10 mm off.

    Args:
        nodes: True nodes [m].
        part: Visible part of 300 points along them.
        noise: Standard deviation of the ranges [m].
        length: Believed length of the rope [m].
        length_ratio: See `ChainFit.solve`.
        free_length: See `ChainFit.solve`.
    """
    dense = polylines.resample(nodes, 300)[part]
    segments = np.minimum(np.linspace(0, len(nodes) - 1, 300).astype(int), len(nodes) - 2)[part]
    anchors = np.zeros((len(nodes), 4))
    anchors[[0, -1], :3], anchors[[0, -1], 3] = nodes[[0, -1]], 3e-4
    rows = np.concatenate([samples(dense, False), samples(dense, True, noise)])
    start = nodes + np.array([0.0, 0.01, 0.0])
    fit = ChainFit(ROPE.node_count, length)
    return fit.solve(
        start,
        rows,
        np.tile(segments, 2),
        EYE,
        anchors,
        length_ratio=length_ratio,
        free_length=free_length,
    )


def test_exact_rays_and_ranges_reproduce_the_chain() -> None:
    nodes = curve(1)
    fit = fitted(nodes)
    errors = np.linalg.norm(fit.nodes - nodes, axis=1)
    assert np.mean(errors) < 5e-4
    assert np.max(errors) < 2e-3
    assert fit.misfit < 0.6
    assert fit.outliers == 0.0


def test_edges_keep_their_length() -> None:
    fit = fitted(curve(2), noise=RANGE_SIGMA)
    edges = np.linalg.norm(np.diff(fit.nodes, axis=0), axis=1)
    np.testing.assert_allclose(edges, ROPE.length / (ROPE.node_count - 1), rtol=0.01)


@pytest.mark.parametrize("ratio", [0.98, 1.0, 1.02])
def test_a_chain_that_may_stretch_tells_the_length_of_the_rope(ratio: float) -> None:
    nodes = curve(2)
    fit = fitted(nodes, length=ratio * ROPE.length, free_length=True)
    assert polylines.length(fit.nodes) == pytest.approx(polylines.length(nodes), rel=2.5e-3)


@pytest.mark.parametrize("ratio", [0.99, 1.01])
def test_a_chain_of_the_told_length_stays_on_the_rope(ratio: float) -> None:
    nodes = curve(2)
    dense = polylines.resample(nodes, 3000)
    right, told, wrong = (
        np.linalg.norm(fit.nodes[:, None] - dense, axis=2).min(axis=1).mean()
        for fit in (
            fitted(nodes),
            fitted(nodes, length=ratio * ROPE.length, length_ratio=1.0 / ratio),
            fitted(nodes, length=ratio * ROPE.length),
        )
    )
    assert told < right + 2e-5
    assert wrong > right + 1e-4


def test_nodes_without_samples_have_no_support_and_a_larger_sigma() -> None:
    visible = fitted(curve(3))
    half = fitted(curve(3), slice(0, 150))
    assert np.all(visible.support[2:-2] > 5.0)
    assert np.all(half.support[18:-2] == 0.0)
    assert np.all(half.sigma[18:-4] > 2.0 * visible.sigma[18:-4])


@pytest.mark.parametrize("count", [5, 20])
def test_outlying_ranges_are_counted_and_do_not_move_the_chain(count: int) -> None:
    nodes = curve(4)
    dense = polylines.resample(nodes, 300)
    segments = np.minimum(np.linspace(0, len(nodes) - 1, 300).astype(int), len(nodes) - 2)
    ranged = samples(dense, True)
    ranged[10 :: 300 // count, 3] += 0.1
    rows = np.concatenate([samples(dense, False), ranged])
    anchors = np.zeros((len(nodes), 4))
    fit = ChainFit(ROPE.node_count, ROPE.length).solve(
        nodes, rows, np.tile(segments, 2), EYE, anchors
    )
    assert fit.outliers == pytest.approx(count / 300, rel=0.01)
    assert np.max(np.linalg.norm(fit.nodes - nodes, axis=1)) < 1e-3


def test_sigma_is_that_of_the_inverse_of_the_normal_equations() -> None:
    nodes = curve(3)
    solver = ChainFit(ROPE.node_count, ROPE.length)
    dense = polylines.resample(nodes, 300)
    segments = np.minimum(np.linspace(0, len(nodes) - 1, 300).astype(int), len(nodes) - 2)
    anchors = np.zeros((len(nodes), 4))
    fit = solver.solve(nodes, samples(dense, True), segments, EYE, anchors)
    band = solver._scratch[0][MARGIN:-MARGIN, 0]
    factor = np.diag(1.0 / band[:, 0])
    for k in range(1, BANDWIDTH):
        factor += np.diag(band[k:, k], -k)
    variance = np.diag(np.linalg.inv(factor @ factor.T)).reshape(-1, 3).sum(axis=1)
    np.testing.assert_allclose(fit.sigma, np.sqrt(variance), rtol=1e-6)

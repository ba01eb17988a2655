"""Estimation with a second rope in view, and with motion blur."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.perception.centerline.estimate import ShapePrior
from lariat.perception.centerline.estimator import CenterlineEstimator
from lariat.simulation.camera.rgbd_camera import Frame
from tests.services.perception.scenes import CAMERA, ROPE, curve, grips, taken

BRIGHT = 60
"""Brightness above which a pixel shows a rope."""


def overlaid(one: Frame, other: Frame) -> Frame:
    """Frame that shows the ropes of two frames, the nearer one in front."""
    rope, second = (f.color.max(axis=2) > BRIGHT for f in (one, other))
    nearer = np.where(other.depth > 0, other.depth, 65535) < np.where(
        one.depth > 0, one.depth, 65535
    )
    use = np.where(rope & second, nearer, second)
    color = np.where(use[..., None], other.color, one.color)
    return Frame(color, np.where(use, other.depth, one.depth).astype(np.uint16))


def second_rope(random: np.random.Generator, seed: int) -> Float64[np.ndarray, "n 3"]:
    """Nodes of a second rope near the table, at a random place [m]."""
    nodes = curve(seed + 100)
    c, s = np.cos(angle := random.uniform(-3.0, 3.0)), np.sin(angle)
    lying = (nodes - nodes.mean(axis=0)) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 0.2]])
    return lying + np.array([*random.uniform(-0.12, 0.12, 2), 0.06])


def blurred(nodes: Float64[np.ndarray, "n 3"], shift: Float64[np.ndarray, "3"], seed: int) -> Frame:
    """Frame exposed while a rope moves by `shift` [m]."""
    frames = [
        taken(nodes + part * shift, frame=10 * seed + k)
        for k, part in enumerate(np.linspace(-0.5, 0.5, 5))
    ]
    color = np.mean([f.color for f in frames], axis=0).astype(np.uint8)
    depths = np.array([f.depth for f in frames], float)
    measured = np.count_nonzero(depths, axis=0)
    depth = np.where(measured > 2, depths.sum(axis=0) / np.maximum(measured, 1), 0.0)
    return Frame(color, depth.astype(np.uint16))


def test_errors_with_a_second_rope_in_view_have_a_large_sigma() -> None:
    random = np.random.default_rng(0)
    solved = 0
    for seed in range(16):
        nodes = curve(seed)
        frame = overlaid(
            taken(nodes, frame=seed), taken(second_rope(random, seed), frame=seed + 500)
        )
        found = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth, *grips(nodes))
        errors = np.linalg.norm(found.positions - nodes, axis=1)
        assert not np.any((errors > 0.01) & (errors > 3.0 * found.sigma)), seed
        solved += np.mean(errors) < 3e-3
    assert solved >= 13


def test_a_second_rope_beneath_a_tracked_one_is_ignored() -> None:
    random = np.random.default_rng(1)
    for seed in range(6):
        nodes = curve(seed)
        frame = overlaid(
            taken(nodes, frame=seed), taken(second_rope(random, seed), frame=seed + 500)
        )
        near = ShapePrior(nodes + random.normal(0.0, 1e-3, nodes.shape), np.full(len(nodes), 3e-3))
        found = CenterlineEstimator(CAMERA, ROPE).estimate(
            frame.color, frame.depth, *grips(nodes), prior=near
        )
        assert np.mean(np.linalg.norm(found.positions - nodes, axis=1)) < 0.6e-3


def test_a_rope_that_moves_during_the_exposure_is_estimated_at_mid_exposure() -> None:
    # 5 mm: 0.5 m/s for 10 ms.
    for seed in range(4):
        nodes, shift = curve(seed), 0.005 * np.array([0.6, 0.8, 0.0])
        frame = blurred(nodes, shift, seed)
        found = CenterlineEstimator(CAMERA, ROPE).estimate(frame.color, frame.depth, *grips(nodes))
        errors = np.linalg.norm(found.positions - nodes, axis=1)
        assert np.mean(errors) < 1e-3
        assert not np.any((errors > 0.01) & (errors > 3.0 * found.sigma))

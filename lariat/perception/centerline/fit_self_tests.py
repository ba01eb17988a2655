"""Launches by which the library of the fit's kernel is compared with Taichi's kernel."""

from __future__ import annotations

import numpy as np

from lariat.kernel_cache.source import SelfTest
from lariat.perception.centerline.bandwidth import scratch

NODE_COUNT = 12
EDGE = 0.05
"""Length of an edge of the true chain [m]."""


def self_tests() -> list[SelfTest]:
    """Return fits to rays with and without ranges, some of them outliers, of a chain in an arc."""
    rng = np.random.default_rng(0)
    tests = []
    for edge_sigma in (3e-5, 1e-3):
        angles = np.linspace(0.0, 0.8, NODE_COUNT)
        arc = np.stack([np.sin(angles), np.zeros(NODE_COUNT), 1.0 - np.cos(angles)], axis=1)
        nodes = arc * EDGE * (NODE_COUNT - 1) / 0.8
        eye = np.array([0.25, -0.6, 0.3])
        places = rng.uniform(-0.5, NODE_COUNT - 0.5, 200)
        segments = np.clip(places, 0, NODE_COUNT - 2).astype(np.int32)
        points = nodes[segments] + (places - segments)[:, None] * np.diff(nodes, axis=0)[segments]
        points += rng.normal(0.0, 1e-4, points.shape)
        points[:10] += 0.05
        ranges = np.linalg.norm(points - eye, axis=1)
        samples = np.zeros((len(points), 6))
        samples[:, :3] = (points - eye) / ranges[:, None]
        samples[::2, 3], samples[::2, 4], samples[::2, 5] = ranges[::2] - 0.004, 0.004, 1.5e-3
        samples[1::2, 5] = 6e-4
        anchors = np.zeros((NODE_COUNT, 4))
        anchors[0] = (*nodes[0], 3e-4)
        start = nodes + np.array([0.0, 0.01, 0.0])
        support, variance, statistics = np.zeros(NODE_COUNT), np.zeros(NODE_COUNT), np.zeros(4)
        arrays = (start, samples, segments, eye, anchors, *scratch(NODE_COUNT), support, variance)
        numbers = (EDGE, edge_sigma, 7.0 * EDGE**2, 0.2, 700.0 * EDGE**3, 1e-5, 30)
        tests.append(
            SelfTest(
                (*arrays, statistics, *numbers), (start, segments, support, variance, statistics)
            )
        )
    return tests

"""Launches by which the libraries of the motion's kernels are compared with Taichi's."""

from __future__ import annotations

import numpy as np

from lariat.kernel_cache.source import SelfTest

BOUNDS = np.array([[0.3, 1.5, 20.0], [1.0, 5.0, 60.0]])
SCALES = (0.0, 0.05, 3.0)


def _vectors(count: int, scale: float, seed: int) -> np.ndarray:
    return scale * np.random.default_rng(seed).normal(size=(count, 3))


def bound_velocities() -> list[SelfTest]:
    """Return velocities at rest, within the bounds and beyond them."""
    tests = []
    for scale in SCALES:
        bounded = np.zeros((20, 3))
        arrays = (_vectors(4, scale, 0), _vectors(20, scale, 1), BOUNDS, bounded)
        tests.append(SelfTest((*arrays, 0.05), (bounded,)))
    return tests


def track_velocities() -> list[SelfTest]:
    """Return wanted velocities at rest, within the bounds and beyond them."""
    tests = []
    for scale in SCALES:
        motion = np.zeros((36, 3))
        present = (_vectors(4, scale, seed) for seed in range(3))
        arrays = (*present, _vectors(16, scale, 3), BOUNDS, motion)
        tests.append(SelfTest((*arrays, 0.3, 0.02), (motion,)))
    return tests


def stop_grips() -> list[SelfTest]:
    """Return stops at rest, of slow grips, and of fast ones that last longer than is asked for."""
    tests = []
    for scale in SCALES:
        motion, results = np.zeros((3 * 4 * 30, 3)), np.zeros(1)
        arrays = (_vectors(4, scale, 0), _vectors(4, scale, 1), BOUNDS, motion, results)
        tests.append(SelfTest((*arrays, 0.02), (motion, results)))
    return tests

"""Launches by which the libraries of the motion's kernels are compared with Taichi's."""

from __future__ import annotations

import numpy as np

from lariat.kernel_cache.source import SelfTest


def _states(count: int, seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    rows = 0.1 * rng.normal(size=(count, 19))
    rows[:, 3] = 1.0
    rows[:, 3:7] /= np.linalg.norm(rows[:, 3:7], axis=1, keepdims=True)
    return rows


def evaluate_reference() -> list[SelfTest]:
    """Return times before, within and after a chunk, while a motion fades and afterwards."""
    rng = np.random.default_rng(0)
    points, mismatch = 0.1 * rng.normal(size=(26, 6)), 0.1 * rng.normal(size=(2, 18))
    first = _states(2, 1)[:, 3:7].copy()
    tests = []
    for u, fade in ((-0.4, 0.0), (3.3, 0.5), (40.0, 1.5)):
        state = np.zeros((2, 19))
        arrays = (points, first, mismatch, state)
        tests.append(SelfTest((*arrays, 10, 0.02, u, fade, 0.1), (state,)))
    return tests


def advance_command() -> list[SelfTest]:
    """Return steps of slow and fast commands."""
    limits = np.array(
        [[0.5, 2.0, 20.0, 1.0, 5.0, 20.0, 0.5], [2.0, 8.0, 80.0, 4.0, 5.0, 20.0, 2.0]]
    )
    tests = []
    for scale in (0.1, 10.0):
        state, now, then = (_states(2, seed) for seed in range(3))
        for rows in (state, now, then):
            rows[:, 7:] *= scale
        results = np.zeros((2, 19)), np.zeros((16, 3)), np.zeros((16, 1)), np.zeros((802, 7))
        ends = np.zeros(2)
        arrays = (limits, state, now, then, *results, ends)
        tests.append(SelfTest((*arrays, 0.008, 0.008, 0.1, 8), (*results, ends)))
    return tests

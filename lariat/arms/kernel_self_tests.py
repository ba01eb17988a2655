"""Launches by which the library of an arm's kernel is compared with Taichi's kernel."""

from __future__ import annotations

import numpy as np

from lariat.kernel_cache.source import SelfTest

SCRATCH_SIZE = 264
"""Numbers of scratch memory for up to six joints."""


JOINTS = np.array([0.2, -0.7, 1.1, 0.4, 0.3, 0.9])
"""Joint angles of an arm at a usual pose [rad]."""


def _chain() -> np.ndarray:
    """Return an arm of six joints."""
    chain = np.zeros((10, 15))
    chain[:, [0, 4, 8]] = 1.0
    chain[:6, 12:] = np.eye(3)[[2, 1, 1, 1, 2, 1]]
    chain[1:7, 9:12] = [
        (0.0, 0.1, 0.15),
        (0.4, 0, 0),
        (0.3, 0, 0),
        (0.1, 0, 0),
        (0, 0, 0.1),
        3 * (0.05,),
    ]
    chain[7, 9:12], chain[8, 9:12], chain[9, 9:12] = (0.2, 0, 0), (0, 0, -0.1), (-0.2, 0, 0)
    return chain


def joint_speeds() -> list[SelfTest]:
    """Return a twist of the grip."""
    velocity, speeds = np.array([[0.1, -0.2, 0.05], [0.3, 0.1, -0.4]]), np.zeros(6)
    arrays = (_chain(), JOINTS[None].copy(), velocity, speeds, np.zeros(SCRATCH_SIZE))
    return [SelfTest((*arrays, 1e-6), (speeds,))]


def follow_path() -> list[SelfTest]:
    """Return a path that is solved, one that leads out of reach, and one that is given."""
    chain = _chain()
    spheres = np.array([[0.0, 0.0, 0.1, 0.0], [2.0, 0.1, 0.0, 0.0], [5.0, 0.0, 0.0, 0.05]])
    tests = []
    for distance, count, exact in ((0.01, 4, 0.01), (2.0, 2, 0.01), (0.0, 0, 9.0)):
        grips = np.zeros((count, 7))
        grips[:, :3] = np.array([0.45, 0.25, 0.3]) + distance * np.arange(count)[:, None]
        grips[:, 3:] = 0.5
        path = np.zeros((count + 1, 6))
        path[0] = JOINTS
        centres, values = np.zeros(((count + 1) * 3, 3)), np.zeros(count + 1)
        scratch = np.zeros(SCRATCH_SIZE)
        arrays = (chain, grips, path, spheres, centres, values, scratch)
        results = (centres, values, scratch[:1])
        tests.append(SelfTest((*arrays, 1e-8, 0.5, 1e-7, 30, exact, count, count + 1), results))
    return tests

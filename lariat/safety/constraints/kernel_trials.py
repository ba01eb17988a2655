"""Launches by which the libraries of the constraints' kernels are compared with Taichi's."""

from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.machine_code.kernel_source import Trial
from lariat.safety.constraints.obstacle_scene import ObstacleScene

TURNED = (0.8, 0.0, 0.6, 0.0)
OBSTACLES = ObstacleScene(
    [
        Obstacle("cylinder", (0.1, 0.0, 0.1), TURNED, radius=0.05, height=0.2),
        Obstacle("box", (-0.1, 0.1, 0.1), TURNED, size=(0.1, 0.2, 0.05)),
        Obstacle("sphere", (0.0, -0.1, 0.2), radius=0.06),
        Obstacle("capsule", (0.2, 0.2, 0.1), TURNED, radius=0.04, height=0.1, keep_in=True),
        Obstacle("box", (5.0, 0.1, 0.1), size=(0.1, 0.2, 0.05)),
        Obstacle("half_space", (0.0, 0.0, 0.0)),
    ]
).table


def _spheres(count: int, poses: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-0.2, 0.3, (count * poses, 3)), rng.uniform(0.02, 0.06, count)


def sphere_slacks() -> list[Trial]:
    """Return spheres among obstacles of every shape."""
    (centres, radii), slacks = _spheres(8, 5, 0), np.zeros((5, 2))
    return [Trial((centres, radii, OBSTACLES, slacks, 0.005, 0.05, 5), (slacks,))]


def gripper_slacks() -> list[Trial]:
    """Return two grippers among obstacles of every shape."""
    rng = np.random.default_rng(1)
    grips = rng.uniform(-0.2, 0.3, (10, 7))
    grips[:, 3:] /= np.linalg.norm(grips[:, 3:], axis=1, keepdims=True)
    spheres = np.array([[0.0, 0.0, 0.0, 0.1], [1.0, 0.0, 0.0, 0.05], [1.0, 0.0, 0.02, 0.1]])
    radii, workspace = np.array([0.02, 0.03, 0.04]), np.array([[-0.3] * 3, [0.25] * 3])
    found = []
    for ends, shift in ((2, 0.0), (2, 5.0), (1, 0.0)):
        centres, slacks, touched = np.zeros((15, 3)), np.zeros((5, 5)), np.zeros(1)
        moved, driven = grips.copy(), np.arange(float(ends))
        moved[:, 2] += shift
        covers = spheres[:ends].copy(), radii[:ends].copy()
        arrays = (moved, driven, *covers, workspace, OBSTACLES, centres, slacks, touched)
        numbers = (ends, 0.005, 0.05, 0.03, 0.4, 5)
        found.append(Trial((*arrays, *numbers), (centres, slacks, touched)))
    return found


def least_distances() -> list[Trial]:
    """Return two sets of spheres that overlap at some poses."""
    distances = np.zeros(5)
    return [Trial((*_spheres(3, 5, 2), *_spheres(2, 5, 3), distances, 5), (distances,))]

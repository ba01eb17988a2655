"""Launches by which the libraries of the camera's kernels are compared with Taichi's kernels."""

from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import Obstacle, pack
from lariat.kernel_cache.source import SelfTest
from lariat.simulation.camera.kernels.depths import BLOCK_SHIFT, DRAWN, FAR, STILL

HEIGHT, WIDTH = 90, 120
"""Size of an image [pixels]."""
CAMERA = np.array([90.0, 90.0, 60.0, 45.0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 0.01, 0.02, 0.03])
"""Pinhole that looks along z, as the kernels take it."""
TILTED = (0.94, 0.2, 0.25, 0.1)
"""Quaternion, to be normalized."""


def bodies() -> list[SelfTest]:
    """Return a drawing of an obstacle of every shape."""
    q = tuple(np.array(TILTED) / np.linalg.norm(TILTED))
    obstacles = [
        Obstacle("half_space", (0.0, 0.3, 1.5), q, normal=(0.0, -0.8, -0.6)),
        Obstacle("cylinder", (-0.3, -0.1, 1.0), q, radius=0.1, height=0.3),
        Obstacle("box", (0.0, 0.1, 0.8), q, size=(0.2, 0.1, 0.3)),
        Obstacle("sphere", (0.3, 0.1, 0.9), q, radius=0.12),
        Obstacle("capsule", (0.1, -0.2, 0.7), q, radius=0.05, height=0.2),
        Obstacle("cone", (-0.1, 0.2, 0.7), q, radius=0.08, height=0.2),
    ]
    image = _image()
    tints = np.random.default_rng(0).uniform(0.0, 255.0, (len(obstacles), 3))
    return [SelfTest((*image, CAMERA, pack(obstacles), tints), image)]


def plates() -> list[SelfTest]:
    """Return a drawing of two plates, one of them partly outside the image."""
    image = _image()
    packed = np.array(
        [
            [0.0, 0.0, 0.8, 0.8, 0.0, 0.6, 0.0, -1.0, 0.0, 0.1],
            [0.5, 0.3, 0.9, 1.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.1],
        ]
    )
    patterns = np.random.default_rng(0).integers(0, 256, (2, 6, 6), np.uint8)
    return [SelfTest((*image, CAMERA, packed, patterns), image)]


def rope() -> list[SelfTest]:
    """Return a drawing of an arc of capsules behind and before what the image shows."""
    image = _image()
    image[1][:, 70:] = 0.8
    angles = np.linspace(-1.0, 1.0, 20)
    nodes = np.stack([0.4 * np.sin(angles), 0.4 * np.cos(angles) - 0.3, 0.8 + 0.1 * angles], axis=1)
    tints = np.tile([12.0, 200.0, 90.0], (19, 1))
    capsules = np.hstack([nodes[:-1], nodes[1:], np.full((19, 1), 0.01), tints])
    scratch = [np.zeros((HEIGHT, WIDTH), np.float32) for _ in range(2)]
    return [SelfTest((*image, *scratch, CAMERA, capsules, 2.0), (*image, *scratch))]


def edges() -> list[SelfTest]:
    """Return the depths of an image with edges and with pixels that show nothing."""
    _, z_buffer, marks = _image()
    z_buffer[5:, :80] = 0.7
    z_buffer[30:60, 20:50] = 0.5
    depth = np.minimum(1e3 * z_buffer, 65535.0).astype(np.uint16)
    marks[::2], marks[1::2] = STILL, DRAWN
    keys = np.random.default_rng(0).integers(0, 1 << 32, HEIGHT, np.uint32)
    settings = np.array([1e-3, 0.02, 0.5, 0.3])
    return [SelfTest((depth, z_buffer, marks, keys, settings), (depth,))]


def _image() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return colours of a grey image, depths where nothing is seen, and no marks."""
    color = np.full((HEIGHT, 3 * WIDTH), 4, np.uint8)
    z_buffer = np.full((HEIGHT, WIDTH), FAR, np.float32)
    return color, z_buffer, np.zeros((HEIGHT, -(-WIDTH >> BLOCK_SHIFT)), np.uint8)

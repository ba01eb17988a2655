"""Normals are the gradients of the distances."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle, outward_normals, signed_distance
from lariat.shapes import SHAPES


@pytest.mark.parametrize("keep_in", [False, True])
@pytest.mark.parametrize("shape", SHAPES)
def test_normals_are_the_gradients_of_signed_distances(shape: str, keep_in: bool) -> None:
    random = np.random.default_rng(3)
    turn = poses.normalized(random.normal(size=4))
    obstacle = Obstacle(
        shape,
        (0.1, -0.2, 0.3),
        tuple(turn),
        0.05,
        0.2,
        (0.1, 0.2, 0.3),
        (1.0, 2.0, 2.0),
        keep_in=keep_in,
    )
    points = np.array(obstacle.position) + 0.15 * random.normal(size=(300, 3))
    step = 1e-7
    differences = np.stack(
        [
            (signed_distance(points + step * e, obstacle) - signed_distance(points, obstacle))
            / step
            for e in np.eye(3)
        ],
        axis=1,
    )
    smooth = np.abs(np.linalg.norm(differences, axis=1) - 1.0) < 1e-4
    assert np.mean(smooth) > 0.97
    assert np.abs(outward_normals(points, obstacle) - differences)[smooth].max() < 1e-4

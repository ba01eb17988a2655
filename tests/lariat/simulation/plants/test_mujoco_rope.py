from __future__ import annotations

import numpy as np
import pytest

from lariat.simulation.plants.mujoco_rope import MujocoRope


def test_an_unloaded_rope_with_rest_curvature_is_a_circle() -> None:
    curvature = 8.0
    rope = MujocoRope(0.45, 0.008, 91, 0.044, 1e6, rest_curvature=(curvature, 0, 0))
    nodes, _ = rope.rest_shape()
    # The tangent stays in the plane of z and y; a circle's chord is 2 sin(s k / 2) / k.
    chord = np.linalg.norm(nodes[-1] - nodes[0])
    assert np.ptp(nodes[:, 0]) < 1e-12
    assert chord == pytest.approx(2.0 / curvature * np.sin(0.45 * curvature / 2.0), rel=1e-3)

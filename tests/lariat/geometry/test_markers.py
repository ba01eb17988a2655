from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.markers import marker_pose
from lariat.geometry.obstacles import Obstacle, signed_distance
from lariat.shapes import SHAPES, ShapeName


@pytest.mark.parametrize("shape", SHAPES)
def test_marker_lies_on_the_surface_with_its_face_upwards(shape: ShapeName) -> None:
    obstacle = Obstacle(shape, (0.1, -0.2, 0.3), radius=0.05, height=0.2, size=(0.1, 0.2, 0.3))
    pose = marker_pose(obstacle)
    assert signed_distance(pose.position, obstacle) == pytest.approx(0.0, abs=1e-15)
    above = pose.apply(np.array([0.0, 0.0, 0.01]))
    assert signed_distance(above, obstacle) == pytest.approx(0.01)

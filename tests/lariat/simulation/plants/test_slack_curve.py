from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.simulation.plants.slack_curve import slack_curve

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
LEFT = Pose(np.array([-0.18, 0.0, 0.3]), ALONG_X)
RIGHT = Pose(np.array([0.18, 0.0, 0.3]), ALONG_X)


def test_a_slack_curve_has_its_length_between_its_grips() -> None:
    curve = slack_curve(LEFT, RIGHT, 0.45, 40)
    np.testing.assert_allclose(curve[[0, -1]], [LEFT.position, RIGHT.position], atol=1e-12)
    assert polylines.length(curve) == pytest.approx(0.45, rel=0.01)

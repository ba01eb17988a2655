from __future__ import annotations

import numpy as np
import pytest

from lariat.safety.constraints.workspace import workspace_slack

BOX = ((-1.0, -1.0, 0.0), (1.0, 1.0, 2.0))


@pytest.mark.parametrize(
    ("grip", "slack"),
    [
        ((0.0, 0.0, 1.0), 1.0),
        ((0.0, 0.7, 1.0), 0.3),
        ((0.0, 0.0, 0.1), 0.1),
        ((1.0, 0.0, 1.0), 0.0),
        ((-1.2, 0.0, 1.0), -0.2),
        ((0.0, 0.0, 2.5), -0.5),
    ],
    ids=["middle", "inside", "low", "boundary", "outside", "above"],
)
def test_slack_is_the_distance_to_the_nearest_face(grip: tuple, slack: float) -> None:
    np.testing.assert_allclose(workspace_slack(np.array([[grip]]), BOX), [slack], atol=1e-15)


def test_worst_grip_counts_at_every_pose() -> None:
    grips = np.array([[[0.0, 0.0, 1.0], [0.0, 0.9, 1.0]], [[0.0, 0.0, -0.1], [0.0, 0.0, 1.0]]])
    np.testing.assert_allclose(workspace_slack(grips, BOX), [0.1, -0.1])

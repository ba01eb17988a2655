"""Arms and camera behind ROS 2: the rope reaches its goal as without it."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.closed_loop import ros2_cell

pytestmark = pytest.mark.ros


@pytest.mark.parametrize("action", [False, True], ids=["topic", "action"])
@pytest.mark.parametrize("name", ["fixed-end", "two-arms"])
def test_the_rope_reaches_its_goal_through_ros2_alone(
    name: str, action: bool, tmp_path: Path
) -> None:
    outcome, points = ros2_cell.run(name, tmp_path, action)
    score = outcome.score
    print(name, action, score, points)
    assert score.reached, outcome.reason
    assert score.final_error_mm is not None
    assert score.final_error_mm < 5.0
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 5.0
    assert len(points) == (2 if name == "two-arms" else 1)
    assert min(points) > (20 if action else 50)

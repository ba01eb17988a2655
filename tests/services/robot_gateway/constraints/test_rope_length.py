from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle
from services.robot_gateway.constraints import rope_length
from services.robot_gateway.constraints.obstacle_scene import ObstacleScene
from services.robot_gateway.constraints.rope_length import RopeLengthConstraint
from services.robot_gateway.constraints.shortest_path import shortest_path_length
from services.robot_gateway.constraints.spacing import grip_distances

POST = Obstacle("cylinder", (0.0, 0.0, 0.3), radius=0.1, height=4.0)


def grips(*half_distances: float) -> np.ndarray:
    return np.array([[[-x, 0.0, 0.3], [x, 0.0, 0.3]] for x in half_distances])


def slack(constraint: RopeLengthConstraint, positions: np.ndarray) -> np.ndarray:
    return constraint.slack(positions, grip_distances(positions))


@pytest.mark.parametrize("expected", [0.2, 0.0, -0.01], ids=["kept", "boundary", "broken"])
def test_free_rope_may_be_as_long_as_the_straight_distance(expected: float) -> None:
    constraint = RopeLengthConstraint(0.5)
    positions = grips((0.5 - expected) / 2.0)
    np.testing.assert_allclose(slack(constraint, positions), [expected], atol=1e-15)


def test_obstacle_between_the_grips_makes_the_path_longer() -> None:
    constraint = RopeLengthConstraint(0.62)
    positions = grips(0.3)
    assert slack(constraint, positions)[0] > 0.0
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    length = shortest_path_length(*positions[0], [TABLE, POST])
    assert length > 0.62
    np.testing.assert_allclose(slack(constraint, positions), [0.62 - length])


def test_slack_is_never_overestimated_where_paths_are_remembered() -> None:
    constraint = RopeLengthConstraint(0.72)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    positions = grips(*np.linspace(0.25, 0.33, 9))
    exact = [0.72 - shortest_path_length(*ends, [TABLE, POST]) for ends in positions]
    assert np.all(slack(constraint, positions) <= np.array(exact) + 1e-12)


def test_remembered_paths_spare_a_search(monkeypatch: pytest.MonkeyPatch) -> None:
    searches = []

    def counted(*arguments: object) -> float:
        searches.append(arguments)
        return shortest_path_length(*arguments)  # pyright: ignore

    monkeypatch.setattr(rope_length, "shortest_path_length", counted)
    constraint = RopeLengthConstraint(0.9)
    constraint.replace_scene(ObstacleScene([TABLE, POST]))
    slack(constraint, grips(0.3))
    slack(constraint, grips(0.301, 0.302))
    assert len(searches) == 1
    constraint.replace_scene(ObstacleScene([POST]))
    slack(constraint, grips(0.3))
    assert len(searches) == 2

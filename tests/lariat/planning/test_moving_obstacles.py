"""Departures of a straight path across the way of a moving obstacle."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from lariat.geometry.obstacle_motion import ObstacleMotion
from lariat.geometry.obstacles import Obstacle, chain_clearance
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.moving_obstacles import (
    DEPARTURE_WINDOW,
    FORESIGHT,
    SWEEP_STEP,
    MovingObstacle,
    departure,
    plan_departure,
    swept_places,
)
from lariat.planning.problem import Problem, WholePath
from lariat.planning.shorter_path import stay
from lariat.scenario import load

SHIFT = np.array([0.0, 0.36, 0.0])
"""Motion of the rope along its path [m]."""
BODY = Obstacle("box", (0.0, 0.0, 0.0), size=(0.12, 0.08, 0.32), name="cart")


@cache
def problem() -> Problem:
    return scenario_problem(load(Path(__file__).parents[3] / "scenarios" / "crossing.toml"))


def straight(duration: float = 2.0) -> WholePath:
    """Path that shifts the rope without changing its shape."""
    share = np.linspace(0.0, 1.0, round(duration / 0.02))[:, None, None]
    here = stay(problem(), "")
    return replace(
        here,
        positions=here.positions[:1] + share * SHIFT,
        orientations=np.repeat(here.orientations[:1], len(share), axis=0),
        nodes=here.nodes[:1] + share * SHIFT,
        reached=True,
    )


def cart(*waypoints: tuple[float, float]) -> MovingObstacle:
    """Cart on the line y = 0.02, at (time, x)."""
    times, places = zip(*waypoints, strict=True)
    return MovingObstacle(
        BODY, ObstacleMotion("cart", times, tuple((x, 0.02, 0.16) for x in places))
    )


def least_clearance(path: WholePath, moving: MovingObstacle, start: float) -> float:
    """Clearance of the rope on its way and for 10 s after [m]."""
    shapes = [*path.nodes, *([path.nodes[-1]] * 500)]
    return min(
        chain_clearance(
            nodes,
            problem().radius,
            [moving.body.moved(moving.motion.position(start + k * path.dt))],
        )
        for k, nodes in enumerate(shapes)
    )


def test_path_departs_at_once_where_the_obstacle_comes_later():
    found = departure(problem(), straight(), [cart((10.0, 0.9), (13.0, -0.3))], 1.0)
    assert found is not None
    assert found.after == 1.0


def test_path_waits_until_the_obstacle_has_passed():
    path, moving = straight(), cart((0.0, 0.6), (6.0, -0.6))
    found = departure(problem(), path, [moving], 1.0)
    assert found is not None
    assert found.after > 1.5
    for late in np.linspace(0.0, DEPARTURE_WINDOW + FORESIGHT, 5):
        assert least_clearance(path, moving, found.after + late) >= problem().clearance
    # Not a second later than needed.
    assert least_clearance(path, moving, found.after - 1.0) < problem().clearance


def test_no_departure_where_the_obstacle_stays_in_the_way_of_the_goal():
    at_goal = MovingObstacle(
        BODY, ObstacleMotion("cart", (0.0, 3.0), ((0.6, 0.2, 0.16), (0.0, 0.2, 0.16)))
    )
    assert departure(problem(), straight(), [at_goal], 0.0) is None
    answer = plan_departure(problem(), [at_goal], 0.0, lambda _: straight())
    assert not answer.path.reached
    assert "'cart'" in answer.path.reason


def test_path_round_the_swept_places_is_taken_where_it_arrives_first():
    asked: list[Problem] = []

    def find(posed: Problem) -> WholePath:
        asked.append(posed)
        path = straight()
        if len(asked) == 1:
            return path
        above = np.array([0.0, 0.0, 1.0])
        return replace(path, nodes=path.nodes + above, positions=path.positions + above)

    slow = cart((0.0, 0.6), (12.0, -0.6))
    found = plan_departure(problem(), [slow], 1.0, find)
    assert [o.name for o in asked[1].obstacles].count("cart") > 10
    assert found.after == 1.0
    assert found.path.nodes[0, 0, 2] > 1.0


def test_swept_places_lie_close_to_each_other():
    moving = cart((0.0, 0.2), (2.0, -0.2))
    places = np.array([o.position for o in swept_places(moving, 1.0)])
    assert places[:, 0].max() == 0.0
    assert places[:, 0].min() == -0.2
    assert np.max(np.abs(np.diff(places[:, 0]))) <= SWEEP_STEP + 1e-9

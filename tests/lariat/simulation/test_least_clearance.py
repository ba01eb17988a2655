"""Gathered ropes have the least clearance and the time in contact of single ones."""

from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle, chain_clearance
from lariat.simulation.least_clearance import GATHERED, LeastClearance
from lariat.trajectory import SECOND

RADIUS = 0.004
PERIOD = SECOND // 30
POST = Obstacle("cylinder", (0.1, 0.0, 0.3), radius=0.03, height=0.1, name="post")
REGION = Obstacle("box", (0.0, 0.0, 0.3), size=(0.9, 0.6, 0.8), keep_in=True, name="region")


def ropes(count: int, nearest: float) -> np.ndarray:
    """A bent rope that comes down beside the post to a distance of its axis, and leaves [m]."""
    x = np.linspace(-0.3, 0.3, 40)
    bend = 0.05 * x**2
    away = nearest + 0.3 * np.abs(np.linspace(-1.0, 1.0, count))[:, None]
    return np.stack(
        [np.broadcast_to(x, (count, 40)), 0.03 + away + bend, np.full((count, 40), 0.3)], axis=2
    )


def moved_post(k: int) -> Obstacle:
    return POST.moved((0.1, 0.001 * k, 0.3))


@pytest.mark.parametrize("moves", [False, True])
@pytest.mark.parametrize("nearest", [0.02, 0.0045, 0.001])
def test_gathered_ropes_are_measured_as_single_ones(nearest: float, moves: bool) -> None:
    found = LeastClearance(RADIUS)
    single = []
    # Another number of nodes from the middle on.
    for k, rope in enumerate(ropes(3 * GATHERED + 5, nearest)):
        nodes = rope[::2] if k > 70 else rope
        scene = (TABLE, moved_post(k) if moves else POST, REGION)
        found.take(PERIOD, nodes, scene)
        single.append(chain_clearance(nodes, RADIUS, scene))
    assert found.least == pytest.approx(min(single), abs=1e-12)
    touched = sum(clearance <= 0.0 for clearance in single)
    assert found.contact_time == pytest.approx(touched * PERIOD / SECOND)
    assert (touched > 0) == (min(single) <= 0.0)


def test_edge_between_two_nodes_counts() -> None:
    found = LeastClearance(RADIUS)
    nodes = np.array([[-0.2, 0.035, 0.3], [0.4, 0.035, 0.3]])
    found.take(PERIOD, nodes, (POST,))
    assert found.least == pytest.approx(0.005 - RADIUS, abs=1e-6)
    assert found.contact_time == 0.0


def test_rope_without_obstacles_is_free() -> None:
    found = LeastClearance(RADIUS)
    found.take(PERIOD, ropes(1, 0.1)[0], ())
    assert (found.least, found.contact_time) == (np.inf, 0.0)

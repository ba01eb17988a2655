from __future__ import annotations

from unittest.mock import Mock

import numpy as np
import pytest
import viser

from dashboard import palette
from dashboard.scene.obstacle_view import ObstacleView
from dashboard.web.private_viser import PrivateViser
from lariat.geometry import obstacles, poses
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import load

TILTED = tuple(poses.exponential(np.array([0.4, -0.7, 0.2])).tolist())


@pytest.mark.parametrize(
    "body",
    [
        Obstacle("cylinder", (0.0, 0.0, 0.0), TILTED, radius=0.03, height=0.16),
        Obstacle("capsule", (0.0, 0.0, 0.0), TILTED, radius=0.03, height=0.16),
        Obstacle("sphere", (0.0, 0.0, 0.0), TILTED, radius=0.03),
        Obstacle("box", (0.0, 0.0, 0.0), TILTED, size=(0.05, 0.1, 0.2)),
    ],
)
def test_top_height_is_that_of_the_highest_point(body: Obstacle) -> None:
    axis = np.linspace(-0.15, 0.15, 121)
    x, y = np.meshgrid(axis, axis)
    for height, inside in ((body.top + 0.001, False), (body.top - 0.004, True)):
        plane = np.stack([x, y, np.full_like(x, height)], axis=-1)
        assert np.any(obstacles.signed_distance(plane, body) < 0.0) == inside


def test_moving_obstacle_is_moved_and_not_drawn_anew() -> None:
    scene = Mock()
    body, label = (Mock(position=np.array(p)) for p in ((0.1, 0.0, 0.2), (0.1, 0.0, 0.4)))
    scene.add_mesh_simple.return_value, scene.add_label.return_value = body, label
    view = ObstacleView(scene, lambda _: None)
    cart = Obstacle("box", (0.1, 0.0, 0.2), size=(0.1, 0.1, 0.3), name="cart")
    view.show([cart])
    view.show([cart.moved((0.1, 0.5, 0.2))])
    scene.add_mesh_simple.assert_called_once()
    np.testing.assert_allclose([body.position, label.position], [[0.1, 0.5, 0.2], [0.1, 0.5, 0.4]])


def test_stops_of_a_route_are_numbered_and_clips_that_hold_are_marked() -> None:
    private = PrivateViser("test")
    view = ObstacleView(private.server.scene, lambda _: None)
    board = load("harness-board")
    view.mark(board.goal.route, ["middle"])
    view.show(board.bodies)
    labels = [h.text for h in handles(view) if isinstance(h, viser.LabelHandle)]
    assert [text for text in labels if text] == ["2 near", "4 far", "1 low", "3 middle ✓", "5 high"]
    colors = [tuple(h.color) for h in handles(view) if isinstance(h, viser.MeshHandle)]
    assert colors.count(palette.GOOD) == 2
    # The cable has left its clip, and the route its peg.
    view.mark(["middle"], [])
    labels = [h.text for h in handles(view) if isinstance(h, viser.LabelHandle)]
    assert [text for text in labels if text] == ["near", "far", "low", "1 middle", "high"]
    assert all(
        tuple(h.color) != palette.GOOD for h in handles(view) if isinstance(h, viser.MeshHandle)
    )
    private.close()


def handles(view: ObstacleView) -> list[viser.SceneNodeHandle]:
    return [handle for _, drawn in view._drawn.values() for handle in drawn]

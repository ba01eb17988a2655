"""Scene guard: garbage is refused whole, and the scenario's bodies stay."""

from __future__ import annotations

from dataclasses import replace

import pytest

from lariat.geometry.obstacle_checks import MAX_OBSTACLES
from lariat.geometry.obstacles import TABLE, Obstacle
from lariat.safety.guard.scene_guard import SceneGuard

POST = Obstacle("cylinder", (0.0, 0.0, 0.1), radius=0.02, height=0.2, name="post")
BALL = Obstacle("sphere", (0.3, 0.0, 0.1), radius=0.05, name="ball")
NAN = float("nan")


@pytest.fixture
def guard() -> SceneGuard:
    return SceneGuard([TABLE, POST])


def test_valid_scene_is_taken_as_it_is(guard: SceneGuard) -> None:
    moved = POST.moved((0.1, 0.0, 0.1))
    assert guard.admit([TABLE, moved, BALL]) == (TABLE, moved, BALL)


def test_empty_scene_leaves_the_scenarios_bodies_where_they_were_last(guard: SceneGuard) -> None:
    moved = POST.moved((0.1, 0.0, 0.1))
    guard.admit([TABLE, moved, BALL])
    assert guard.admit([]) == (TABLE, moved)


@pytest.mark.parametrize(
    ("obstacle", "refusal"),
    [
        (replace(BALL, position=(NAN, 9.0, 9.0)), "not finite"),
        (replace(BALL, radius=float("inf")), "not finite"),
        (replace(BALL, radius=-0.1), "takes 0 < radius"),
        (replace(BALL, orientation=(2.0, 0.0, 0.0, 0.0)), "not a unit quaternion"),
        (replace(BALL, shape="torus"), "use one of"),
        (replace(BALL, name=""), "needs a name"),
        (replace(POST, radius=0.001), "whose bodies only move"),
        (replace(TABLE, position=(0.0, 0.0, -1.0)), "whose bodies only move"),
    ],
)
def test_scene_with_one_invalid_obstacle_is_refused_whole(
    guard: SceneGuard, obstacle: Obstacle, refusal: str
) -> None:
    with pytest.raises(ValueError, match=refusal):
        guard.admit([obstacle])
    assert guard.admit([]) == (TABLE, POST)


def test_too_many_obstacles_and_equal_names_are_refused(guard: SceneGuard) -> None:
    many = [replace(BALL, name=f"ball {k}") for k in range(MAX_OBSTACLES + 1)]
    with pytest.raises(ValueError, match=r"257.*256"):
        guard.admit(many)
    with pytest.raises(ValueError, match="the same name"):
        guard.admit([BALL, BALL])

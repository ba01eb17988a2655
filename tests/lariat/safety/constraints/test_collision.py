from __future__ import annotations

import numpy as np
import pytest

from lariat.geometry.obstacles import TABLE, Obstacle, signed_distance
from lariat.safety.constraints.collision import EXACT_SLACK, CollisionConstraint
from lariat.safety.constraints.obstacle_scene import ObstacleScene
from lariat.safety.constraints.slacks import first_broken

KEEP_OUT = 0.005
RADIUS = np.array([0.01])
BALL = Obstacle("sphere", (0.0, 0.0, 0.5), radius=0.1)
BOX = Obstacle("box", (0.0, 0.0, 0.5), size=(0.2, 0.4, 0.1))
POST = Obstacle("cylinder", (0.0, 0.0, 0.5), radius=0.05, height=0.6)
CAPSULE = Obstacle("capsule", (0.0, 0.0, 0.5), radius=0.05, height=0.3)


def constraint(*obstacles: Obstacle) -> CollisionConstraint:
    made = CollisionConstraint(KEEP_OUT)
    made.scene = ObstacleScene(obstacles)
    return made


def at(x: float, z: float = 0.5) -> np.ndarray:
    return np.array([[[x, 0.0, z]]])


@pytest.mark.parametrize("slack", [0.03, 0.0, -0.01], ids=["kept", "boundary", "broken"])
def test_keep_out_is_the_distance_of_surfaces_less_what_is_kept(slack: float) -> None:
    slacks = constraint(BALL).slacks(at(0.1 + 0.01 + KEEP_OUT + slack), RADIUS)
    np.testing.assert_allclose(slacks["keep_out"], [slack], atol=1e-12)
    assert slacks["table"] == np.inf


@pytest.mark.parametrize("slack", [0.3, 0.0, -0.01], ids=["kept", "boundary", "broken"])
def test_table_may_be_touched_but_not_entered(slack: float) -> None:
    slacks = constraint(TABLE).slacks(at(0.0, 0.01 + slack), RADIUS)
    np.testing.assert_allclose(slacks["table"], [slack], atol=1e-12)
    assert slacks["keep_out"] == np.inf


@pytest.mark.parametrize("solid", [BALL, BOX, POST, CAPSULE], ids=lambda solid: solid.shape)
def test_slack_far_away_is_a_lower_bound_and_exact_nearby(solid: Obstacle) -> None:
    centres = np.random.default_rng(0).normal([0.0, 0.0, 0.5], 0.4, size=(300, 1, 3))
    slack = constraint(solid).slacks(centres, RADIUS)["keep_out"]
    exact = signed_distance(centres[:, 0], solid) - (RADIUS[0] + KEEP_OUT)
    assert np.all(slack <= exact + 1e-12)
    near = exact < EXACT_SLACK
    assert near.any()
    np.testing.assert_allclose(slack[near], exact[near], atol=1e-12)


@pytest.mark.parametrize("solid", [BALL, BOX, POST, CAPSULE], ids=lambda solid: solid.shape)
def test_bounding_sphere_contains_the_solid(solid: Obstacle) -> None:
    points = np.random.default_rng(1).uniform(-0.5, 0.5, size=(20_000, 3))
    points[:, 2] += 0.5
    inside = points[signed_distance(points, solid) <= 0.0]
    assert np.max(np.linalg.norm(inside - solid.position, axis=1)) <= solid.bounding_radius


def test_nearest_of_several_obstacles_and_spheres_counts() -> None:
    centres = np.array([[[0.0, 0.0, 0.9], [0.3, 0.0, 0.5]]])
    slacks = constraint(BALL, TABLE).slacks(centres, np.array([0.01, 0.02]))
    np.testing.assert_allclose(slacks["keep_out"], [0.18 - KEEP_OUT])
    np.testing.assert_allclose(slacks["table"], [0.48])


def test_end_without_a_body_is_free() -> None:
    slacks = constraint(BALL, TABLE).slacks(np.zeros((2, 0, 3)), np.zeros(0))
    assert np.all(np.isinf(slacks["keep_out"]))
    assert np.all(np.isinf(slacks["table"]))


def test_centres_that_are_not_finite_break_the_rules() -> None:
    made = constraint(BALL, TABLE)
    for centres in (
        np.full((2, 3, 3), np.nan),
        np.array([[[9.0, 0.0, 9.0]] * 3, [[np.nan] * 3] * 3]),
    ):
        slacks = made.slacks(centres, np.ones(3))
        assert first_broken({"keep_out": slacks["keep_out"]}) is not None
        assert first_broken({"table": slacks["table"]}) is not None

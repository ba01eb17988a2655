from __future__ import annotations

import numpy as np

from lariat.geometry.obstacles import Obstacle
from lariat.safety.constraints.collision import EXACT_SLACK, CollisionConstraint
from lariat.safety.constraints.near_solids import NearSolids
from lariat.safety.constraints.obstacle_scene import ObstacleScene

RADII = np.array([0.03, 0.05, 0.04])
RNG = np.random.default_rng(5)
BOXES = [
    Obstacle("box", tuple(at), size=(0.04, 0.06, 0.02), name=str(k))
    for k, at in enumerate(RNG.uniform(-0.5, 0.5, size=(120, 3)))
]


def constraint(obstacles: list[Obstacle]) -> CollisionConstraint:
    made = CollisionConstraint(0.005)
    made.scene = ObstacleScene(obstacles)
    return made


def path(centre: np.ndarray) -> np.ndarray:
    """Three spheres that move by a few centimetres."""
    offsets = np.array([[0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.1, 0.1, 0.0]])
    steps = np.linspace(0.0, 1.0, 5)[:, None, None] * RNG.normal(0.0, 0.02, size=3)
    return centre + offsets + steps


def test_remembered_list_gives_the_slack_of_all_solids() -> None:
    collision, near = constraint(BOXES), NearSolids()
    centre = np.array([-0.4, 0.0, 0.0])
    broken = far = 0
    for k in range(160):
        if k == 80:
            moved = [Obstacle("box", (0.0, 0.0, 0.0), size=(0.1, 0.1, 0.1), name="new")]
            collision = constraint(BOXES[:60] + moved)
        centre = centre + RNG.normal([0.005, 0.0, 0.0], 0.004)
        centres = path(centre)
        found = collision.slacks(centres, RADII, near)["keep_out"]
        every = collision.slacks(centres, RADII)["keep_out"]
        exact = every < EXACT_SLACK
        np.testing.assert_allclose(found[exact], every[exact], atol=1e-12)
        assert np.all(found[~exact] >= EXACT_SLACK)
        broken += int(np.any(every < 0.0))
        far += int(np.any(~exact))
    assert min(broken, far) > 10


def test_list_stays_while_the_bodies_stay_near() -> None:
    collision, near = constraint(BOXES), NearSolids()
    centres = path(np.zeros(3))
    collision.slacks(centres, RADII, near)
    listed = near.columns
    assert len(listed) < len(BOXES)
    collision.slacks(centres + 0.03, RADII, near)
    assert near.columns is listed
    collision.slacks(centres + 0.05, RADII, near)
    assert near.columns is not listed

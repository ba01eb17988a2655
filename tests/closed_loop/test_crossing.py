"""A cart crosses between the rope and its goal; where it moves is known."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from lariat.scenario.settings import load_with
from shared import topics
from stack.simulation import closed_loop

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_rope_waits_for_a_cart_to_pass_and_is_not_touched():
    # Where nobody knows the cart's motion, the rope comes within 1 mm of it.
    scenario = load_with(SCENARIOS / "crossing.toml", ("plant.model=rod",))
    outcome = closed_loop.run(scenario, stop_after=0.0)
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 8.0
    assert score.replans == 0
    scene, motion = (outcome.stack.latest(t) for t in (topics.SCENE_STATE, topics.SCENE_MOTION))
    assert scene is not None
    assert motion is not None
    # What moves by itself is no change of the scene.
    assert scene.revision == 1
    (cart,) = motion.motions
    assert cart.position[0] < 0.3
    np.testing.assert_allclose(cart.velocity, [-0.2, 0.0, 0.0])


def test_rope_waits_for_what_moves_as_fast_as_a_hand():
    begins = "{time=0.7, position=[0.6, 0.02, 0.16]}"
    path = f"obstacles.0.path=[{begins}, {{time=1.9, position=[-0.6, 0.02, 0.16]}}]"
    scenario = load_with(SCENARIOS / "crossing.toml", ("plant.model=rod", path))
    outcome = closed_loop.run(scenario, stop_after=0.0)
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.min_clearance_mm is not None
    assert score.min_clearance_mm > 8.0
    # Not before the cart has gone by.
    assert score.reached_s is not None
    assert score.reached_s > 1.9

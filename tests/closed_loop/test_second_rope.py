"""A second rope in the way, which nobody names: it is seen and avoided."""

from __future__ import annotations

from pathlib import Path

from lariat.scenario.settings import load_with
from shared import topics
from stack.simulation import closed_loop

SCENARIOS = Path(__file__).parents[2] / "scenarios"


def test_a_rope_that_lies_in_the_way_is_not_touched():
    # Without `rope/others`, ours passes through it, 6 mm deep.
    scenario = load_with(SCENARIOS / "second-rope.toml", ("sensing.rate=15",))
    outcome = closed_loop.run(scenario, stop_after=0.0)
    score = outcome.score
    assert score.reached, outcome.reason
    assert score.min_distractor_clearance_mm is not None
    assert score.min_distractor_clearance_mm > 5.0
    scene = outcome.stack.latest(topics.SCENE_STATE)
    assert scene is not None
    assert [o.name for o in scene.obstacles] == ["table"]

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.robustness.combinations import Combination, sample
from benchmarks.robustness.observability import bounds
from benchmarks.robustness.scene import arms_reach, build_scene
from lariat.geometry import polylines
from lariat.geometry.obstacles import chain_clearance
from lariat.scenario import load
from lariat.simulation.plants.factory import build_plant
from lariat.simulation.rest_shape import goal_grips


def combination(name: str, **changes: object) -> Combination:
    """A combination with our rod as its plant, which is quick."""
    changes = {"plant": "rod", "goal": "shipped", "rotates": False} | changes
    return replace(sample(0, 0, (name,)), **changes)


def test_goal_is_a_rest_shape_of_the_true_rope_as_truly_held(tmp_path: Path) -> None:
    scenario = build_scene(combination("rope"), tmp_path)
    rope = build_plant(scenario)
    rope.reset(*goal_grips(load("rope")))
    goal = scenario.nodes(scenario.goal)
    assert goal is not None
    seen = polylines.resample_smooth(rope.nodes, len(goal))
    np.testing.assert_allclose(goal, seen, atol=2e-6)
    # The left end is fixed; the rope is held 3 mm beside it.
    aside = np.linalg.norm(goal[0] - scenario.grips(scenario.start)[0].position)
    np.testing.assert_allclose(aside, 0.003, atol=1e-5)


def test_seeded_goals_keep_clear_of_the_obstacles(tmp_path: Path) -> None:
    shipped = build_scene(combination("three-cylinders"), tmp_path / "shipped")
    seeded = build_scene(
        combination("three-cylinders", goal="seeded", rotates=True), tmp_path / "seeded"
    )
    for scenario in (shipped, seeded):
        nodes = scenario.nodes(scenario.goal)
        assert nodes is not None
        assert chain_clearance(nodes, scenario.rope.diameter / 2.0, scenario.bodies) > 0.0095
    apart = seeded.grips(seeded.goal)[0].position - shipped.grips(shipped.goal)[0].position
    assert 0.005 < np.linalg.norm(apart) < 0.15


def test_arms_can_stand_at_seeded_goals(tmp_path: Path) -> None:
    # The first goal of this combination would bring a link of the left arm below the table.
    scenario = build_scene(replace(sample(1, 7), plant="rod", node_count=60), tmp_path)
    nodes = scenario.nodes(scenario.goal)
    assert nodes is not None
    assert arms_reach(scenario, nodes, *goal_grips(scenario))


def test_a_taut_rope_tells_its_stiffness_less_than_a_slack_one(tmp_path: Path) -> None:
    slack = build_scene(combination("fixed-end", stiffness_ratio=1.0), tmp_path)
    start = slack.start.line
    assert start is not None
    taut = replace(
        slack,
        start=replace(slack.start, line=((-0.205, 0.0, 0.3), (0.205, 0.0, 0.3))),
        goal=replace(slack.goal, nodes="", line=((-0.205, 0.1, 0.3), (0.205, 0.1, 0.3))),
        ends=replace(slack.ends, left=slack.ends.right),
    )
    assert bounds(slack).stiffness < bounds(taut).stiffness


def test_place_along_the_rope_is_told_by_the_grips_alone(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    scenario = build_scene(combination("fixed-end"), tmp_path)
    unsure = bounds(scenario).place
    monkeypatch.setattr("benchmarks.robustness.observability.GRIP_OFFSET", 3e-5)
    assert bounds(scenario).place < 0.2 * unsure
    assert 3e-4 < unsure < 1.3e-3

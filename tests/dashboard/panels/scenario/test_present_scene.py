"""Present goal and obstacles as settings of a scenario."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from dashboard.panels.scenario.present_scene import goal_settings, obstacle_settings
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.scenario import SIDES, Goal, Scenario, find, load
from lariat.scenario.settings import load_with
from lariat.scenario.shipped import shipped_names


def published_goal(scenario: Scenario) -> Goal:
    """Goal of a scenario as the controller publishes it: what an end cannot move is the start's."""
    left, right = (
        Pose(
            (start if scenario.end(side).driver == "fixed" else goal).position,
            (goal if scenario.end(side).rotates else start).orientation,
        )
        for side, start, goal in zip(
            SIDES, scenario.grips(scenario.start), scenario.grips(scenario.goal), strict=True
        )
    )
    return Goal(np.zeros((0, 3)), left, right, **scenario.goal.terms)


@pytest.mark.parametrize("name", shipped_names())
def test_scene_of_the_scenario_needs_no_setting(name: str) -> None:
    scenario = load(name)
    assert goal_settings(published_goal(scenario), scenario) == []
    assert obstacle_settings(scenario.bodies, scenario) == []


@pytest.mark.parametrize("name", ["rope", "two-turns"])
def test_goal_is_saved_by_its_grips(name: str) -> None:
    scenario = load(name)
    goal = published_goal(scenario)
    left, right = goal.grips
    moved = Pose(right.position + np.array([0.01, 0.0, -0.02]), right.orientation)
    saved = load_with(find(name), goal_settings(replace(goal, right=moved), scenario))
    kept = published_goal(saved)
    for pose, wanted in ((kept.left, left), (kept.right, moved)):
        assert pose.position == pytest.approx(wanted.position, abs=1e-6)
        assert pose.orientation == pytest.approx(wanted.orientation, abs=1e-5)
    assert saved.goal.turns == scenario.goal.turns


def test_stretch_of_a_goal_is_saved_with_its_grips() -> None:
    scenario = load("three-cylinders")
    whole = published_goal(scenario)
    goal = replace(whole, part=(0.12, 0.3))
    saved = load_with(find("three-cylinders"), goal_settings(goal, scenario))
    assert saved.goal.part == (0.12, 0.3)
    for kept, wanted in zip(saved.grips(saved.goal), scenario.grips(scenario.goal), strict=True):
        assert kept.position == pytest.approx(wanted.position, abs=1e-6)
    # The stretch of the scenario that is saved needs no setting, and the whole rope needs one.
    assert goal_settings(goal, saved) == []
    again = load_with(find("three-cylinders"), goal_settings(whole, saved))
    assert again.goal.part is None


def test_obstacles_are_saved_as_they_stand() -> None:
    scenario = load("three-cylinders")
    table, first, second, *others = scenario.bodies
    moved = replace(second, position=(0.1, 0.2, 0.05))
    new = Obstacle("box", (0.0, 0.3, 0.1), size=(0.1, 0.1, 0.2), support=True, name="box-new")
    saved = load_with(
        find("three-cylinders"), obstacle_settings((table, moved, *others, new), scenario)
    )
    assert first.name not in [b.name for b in saved.bodies]
    assert saved.bodies == (table, moved, *others, new)


def test_marked_obstacle_stays_where_the_file_has_it() -> None:
    scenario = load("markers")
    marked = next(iter(scenario.marked_obstacles))
    bodies = tuple(
        replace(b, position=(0.3, 0.3, 0.1)) if b.name == marked else b for b in scenario.bodies
    )
    assert obstacle_settings(bodies, scenario) == []

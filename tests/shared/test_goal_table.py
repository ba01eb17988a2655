"""Goals as tables: what is saved on the page is the same goal in a scenario."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.configuration import ConfigurationError
from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.rod.part_fit import part_points
from lariat.scenario import Shape, checks, load
from shared.goal_table import GOAL_LINE, goal_table, read_entry
from shared.messages import Goal, SavedGoal, grip

SCENARIO = load("three-cylinders")
COUNT, LENGTH = SCENARIO.rope.node_count, SCENARIO.rope.length
ANGLE = np.linspace(0.0, np.pi, COUNT)
RADIUS = LENGTH / np.pi
NODES = np.stack([-RADIUS * np.cos(ANGLE), 0.0 * ANGLE, 0.4 - RADIUS * np.sin(ANGLE)], axis=1)
TURNED = np.array([0.8, 0.0, 0.6, 0.0])


def saved(**fields) -> SavedGoal:
    goal = Goal(
        positions=NODES.ravel(),
        left=grip(Pose(NODES[0], TURNED)),
        right=grip(Pose(NODES[-1], TURNED)),
        **fields,
    )
    return SavedGoal(name="arch", scenario="three-cylinders", goal=goal)


def shape_of(goal: SavedGoal) -> Shape:
    shape = read_entry(goal_table(goal))
    assert shape is not None
    return shape


@pytest.mark.parametrize(
    ("fields", "shape"),
    [
        ({}, Shape(nodes="arch.csv")),
        ({"part": [0.1, 0.3]}, Shape(nodes="arch.csv", part=(0.1, 0.3))),
        (
            {"right_oriented": True, "turns": 2.0},
            Shape(nodes="arch.csv", right_orientation=(0.8, 0.0, 0.6, 0.0), turns=2.0),
        ),
        (
            {"ends_only": True, "left_oriented": True},
            Shape(
                line=((-0.143239, 0.0, 0.4), (0.143239, 0.0, 0.4)),
                ends_only=True,
                left_orientation=(0.8, 0.0, 0.6, 0.0),
            ),
        ),
    ],
)
def test_table_says_what_of_the_goal_counts(fields: dict, shape: Shape) -> None:
    assert shape_of(saved(**fields)) == shape


def test_part_of_a_saved_goal_is_the_same_in_a_scenario(tmp_path: Path) -> None:
    goal = saved(part=[0.1, 0.3])
    (tmp_path / "arch.csv").write_text(goal_table(goal))
    scenario = replace(SCENARIO, goal=shape_of(goal), folder=tmp_path)
    checks.check(scenario)
    own = scenario.part_nodes(scenario.goal)
    assert own is not None
    assert polylines.length(own) == pytest.approx(0.2, rel=1e-3)
    points, counted = part_points(own, (0.1, 0.3), COUNT, LENGTH)
    assert np.array_equal(counted, polylines.within(NODES, 0.1, 0.3))
    assert points == pytest.approx(NODES[counted], abs=2e-5)


def test_table_of_another_program_says_nothing_about_what_counts() -> None:
    assert read_entry("# x, y, z\n0,0,0\n") is None


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        ("{nodes = ", "is no goal"),
        ("7", "no table"),
        ("{nodes = 'arch.csv', part = [0.3, 0.1]}", "ends before it begins"),
        ("{nodes = 'arch.csv', part = [0.1, nan]}", "finite"),
        ("{nodes = 'arch.csv', parts = [0.1, 0.2]}", "parts"),
    ],
)
def test_broken_line_is_refused(entry: str, words: str) -> None:
    with pytest.raises((ValueError, ConfigurationError), match=words):
        read_entry(f"{GOAL_LINE}{entry}\n0,0,0\n")

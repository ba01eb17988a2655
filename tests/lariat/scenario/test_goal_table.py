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
from lariat.scenario import Goal, Shape, checks, load, parse
from lariat.scenario.entries import inline
from lariat.scenario.goal_table import GOAL_LINE, goal_table, read_entry, read_goal

SCENARIO = load("three-cylinders")
COUNT, LENGTH = SCENARIO.rope.node_count, SCENARIO.rope.length
ANGLE = np.linspace(0.0, np.pi, COUNT)
RADIUS = LENGTH / np.pi
NODES = np.stack([-RADIUS * np.cos(ANGLE), 0.0 * ANGLE, 0.4 - RADIUS * np.sin(ANGLE)], axis=1)
TURNED = np.array([0.8, 0.0, 0.6, 0.0])


def saved(**fields) -> Goal:
    return Goal(NODES, Pose(NODES[0], TURNED), Pose(NODES[-1], TURNED), **fields)


def shape_of(goal: Goal) -> Shape:
    shape = read_entry(goal_table(goal, "arch", "three-cylinders"))
    assert shape is not None
    return shape


@pytest.mark.parametrize(
    ("fields", "shape"),
    [
        ({}, Shape(nodes="arch.csv")),
        ({"part": (0.1, 0.3)}, Shape(nodes="arch.csv", part=(0.1, 0.3))),
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
    goal = saved(part=(0.1, 0.3))
    (tmp_path / "arch.csv").write_text(goal_table(goal, "arch", "three-cylinders"))
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


def rows(nodes: np.ndarray, separator: str = ",") -> str:
    return "".join(separator.join(f"{v:.6f}" for v in row) + "\n" for row in nodes)


FORMS = {
    "mark.csv": ("\ufeff" + rows(NODES)).encode(),
    "header.csv": ("x,y,z\n" + rows(NODES)).encode(),
    "index.csv": rows(np.insert(NODES, 0, np.arange(COUNT), axis=1)).encode(),
    "comma.csv": rows(NODES, ";").replace(".", ",").encode(),
    "wide.csv": rows(NODES, "\t").encode("utf-16"),
}


@pytest.mark.parametrize("name", FORMS)
def test_scenario_and_goal_read_tables_of_spreadsheets_alike(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(FORMS[name])
    scenario = replace(SCENARIO, goal=Shape(nodes=name), folder=tmp_path)
    goal = read_goal(FORMS[name])
    np.testing.assert_allclose(goal.nodes, NODES, atol=1e-6)
    np.testing.assert_allclose(scenario.nodes(scenario.goal), NODES, atol=5e-5)
    for own, grip in zip(scenario.grips(scenario.goal), goal.grips, strict=True):
        np.testing.assert_allclose(own.position, grip.position, atol=1e-6)
        np.testing.assert_allclose(own.orientation, grip.orientation, atol=1e-4)


def test_goal_is_an_array_or_a_table_in_millimetres(tmp_path: Path) -> None:
    by_array = replace(SCENARIO, goal=replace(SCENARIO.goal, nodes=NODES))
    assert by_array.goal.line is None
    (tmp_path / "mm.csv").write_text(rows(1e3 * NODES))
    with pytest.raises(ValueError, match=r"scale = 0\.001"):
        checks.check(replace(SCENARIO, goal=Shape(nodes="mm.csv"), folder=tmp_path))
    scaled = replace(SCENARIO, goal=Shape(nodes="mm.csv", scale=1e-3), folder=tmp_path)
    for scenario in (by_array, scaled):
        checks.check(scenario)
        np.testing.assert_allclose(scenario.nodes(scenario.goal), NODES, atol=5e-5)
    assert parse(SCENARIO_TEXT.format(inline(NODES.tolist())), tmp_path).goal == by_array.goal


SCENARIO_TEXT = """
name = "array"
rope = {{length = 0.45, diameter = 0.008}}
start = {{line = [[-0.21, -0.12, 0.30], [0.21, -0.12, 0.30]]}}
goal = {{nodes = {}}}
"""


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"x,y,z\n0,0,0\n0,0,nan\n1,0,0\n", "line 3 is not finite"),
        (b"0,0,0\n0,0,zero\n1,0,0\n", "line 2: '0,0,zero'"),
        (b"0,0,0\n1,0,0\n", "2 rows of numbers; give at least 3 rows"),
        (b"0,0,0\n0,0,0\n0,0,0\n", "the same point"),
        (rows(1e4 * NODES).encode(), r"beyond ±100 m; .* scale = 0\.001"),
        (b"\x89PNG\r\n\x1a\n", "no text"),
        (b"", "no rows"),
    ],
)
def test_file_without_a_goal_is_refused_with_its_reason(content: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        read_goal(content)


def test_saved_goal_is_loaded_with_what_of_it_counts() -> None:
    for goal in (
        saved(part=(0.1, 0.3)),
        saved(route=("clip", "left of peg")),
        saved(ends_only=True, left_oriented=True),
    ):
        again = read_goal(goal_table(goal, "arch", "three-cylinders").encode())
        assert again.terms == goal.terms
        assert again.left_oriented == (goal.left_oriented and goal.part is None)
        np.testing.assert_allclose(again.nodes, goal.nodes, atol=1e-6)
    np.testing.assert_allclose(again.left.orientation, TURNED, atol=1e-6)

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from dashboard.editors import goal_file
from lariat.geometry import polylines
from lariat.scenario import Goal, Shape, load
from shared.goal_table import goal_table
from shared.messages import SavedGoal, goal_message

SCENARIO = load("scenarios/three-cylinders.toml")
ARC = np.linspace(0.0, np.pi, 25)
RADIUS = SCENARIO.rope.length / np.pi


def rows(nodes: np.ndarray) -> bytes:
    return "\n".join(",".join(f"{v:.6f}" for v in row) for row in nodes).encode()


def half_circle(scale: float = 1.0) -> np.ndarray:
    r = scale * RADIUS
    return np.stack([-r * np.cos(ARC), 0.0 * ARC, 0.3 - r * np.sin(ARC)], axis=1)


def test_shape_gets_the_nodes_of_the_rope_and_the_grips_of_a_scenario(tmp_path: Path) -> None:
    content = b"# x, y, z\n" + rows(half_circle())
    goal = goal_file.parse(content, SCENARIO)
    nodes = goal.nodes
    assert len(nodes) == SCENARIO.rope.node_count
    assert polylines.length(nodes) == pytest.approx(SCENARIO.rope.length, rel=3e-3)
    (tmp_path / "goal.csv").write_bytes(rows(nodes))
    at_file = type(SCENARIO)(**{**vars(SCENARIO), "folder": tmp_path})
    for grip, pose in zip(goal.grips, at_file.grips(Shape(nodes="goal.csv")), strict=True):
        np.testing.assert_allclose(grip.position, pose.position, atol=1e-6)
        np.testing.assert_allclose(grip.orientation, pose.orientation, atol=1e-4)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (rows(half_circle(1.2)), "scale the shape"),
        (rows(1e3 * half_circle()), "are its numbers millimetres"),
        (b"1,2\n3,4\n5,6\n", "line 1: 2 numbers"),
        (b"x,y,z\n0,0,0\n0,0,nan\n1,0,0\n", "line 3: '0,0,nan' is not finite"),
        (b"0,0,0\n0,0,zero\n1,0,0\n", "line 2: '0,0,zero' is not x, y, z"),
        (b"0,0,0\n1,0,0\n", "2 rows of numbers; give at least 3 rows"),
        (b"\x89PNG\r\n", "no text"),
        (b"", "at least 3 rows of x, y, z"),
    ],
)
def test_file_without_a_goal_is_refused_with_its_reason(content: bytes, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        goal_file.parse(content, SCENARIO)


@pytest.mark.parametrize(
    ("header", "separator", "decimal"),
    [
        ("x,y,z\n", ",", "."),
        ('"x [m]";"y [m]";"z [m]"\n', ";", ","),
        ("", ";", "."),
        ("\ufeffX\tY\tZ\n", "\t", "."),
        ("# from a table\n", "  ", "."),
    ],
)
def test_tables_of_other_programs_give_the_same_goal(
    header: str, separator: str, decimal: str
) -> None:
    table = "\n".join(
        separator.join(f"{v:.6f}".replace(".", decimal) for v in row) for row in half_circle()
    )
    goal = goal_file.parse((header + table).encode(), SCENARIO)
    expected = goal_file.parse(rows(half_circle()), SCENARIO)
    assert goal_message(goal) == goal_message(expected)


def test_saved_goal_is_loaded_with_what_of_it_counts() -> None:
    goal = goal_file.parse(rows(half_circle()), SCENARIO)
    again = saved_and_loaded(replace(goal, part=(0.1, 0.3)))
    assert again.part == (0.1, 0.3)
    assert again.nodes == pytest.approx(goal.nodes, abs=1e-6)
    again = saved_and_loaded(replace(goal, ends_only=True))
    assert (again.ends_only, again.part) == (True, None)
    assert again.right.position == pytest.approx(goal.right.position, abs=1e-6)


def saved_and_loaded(goal: Goal) -> Goal:
    saved = SavedGoal(name="arch", scenario="three-cylinders", goal=goal_message(goal))
    return goal_file.parse(goal_table(saved).encode(), SCENARIO)


@pytest.mark.parametrize(
    ("part", "words"),
    [("[0.1, 0.6]", "beyond its end"), ("[0.0, 0.44]", "more than 0.9"), ("[0.1, 0.11]", "nodes")],
)
def test_part_that_the_rope_does_not_have_is_refused(part: str, words: str) -> None:
    line = f"# goal = {{nodes = 'x.csv', part = {part}}}\n".encode()
    with pytest.raises(ValueError, match=words):
        goal_file.parse(line + rows(half_circle()), SCENARIO)

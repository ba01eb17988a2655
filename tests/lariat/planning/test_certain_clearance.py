"""Clearance that a path keeps with 99 %: what drawn ropes take of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.control.estimation.rope_unknowns import RopeUnknowns
from lariat.geometry.obstacles import Obstacle
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.certain_clearance import DRAWS, certain_clearance, drawn_ropes, driven_rope
from lariat.planning.problem import UNMOVED, DrawnRope, Problem, WholePath
from lariat.planning.whole_path import plan
from lariat.rod import Rod
from lariat.scenario.settings import load_with

DEVIATION = 0.002


@pytest.fixture(scope="module")
def beside_a_wall() -> tuple[Problem, WholePath]:
    """A hanging rope is moved along a wall that stands across y, behind it."""
    problem = scenario_problem(load_with("three-cylinders"))
    aside, here = np.array([0.05, 0.0, 0.0]), problem.state.positions
    wall = Obstacle("box", (0.0, float(here[0, 1]) + 0.13, 0.5), size=(3.0, 0.2, 1.0))
    left, right = (replace(grip, position=grip.position + aside) for grip in problem.grips)
    goal = replace(problem.goal, nodes=here + aside, left=left, right=right)
    problem = replace(problem, goal=goal, obstacles=(wall,))
    path = plan(problem)
    assert path.reached, path.reason
    return problem, path


def drawn(rod: Rod, **entries: float) -> tuple[DrawnRope, ...]:
    """Ropes of which unknowns, by name and index, are off by one and the same normal number."""
    unknowns = RopeUnknowns.of(rod.properties)
    factor = np.zeros(unknowns.count)
    for name, deviation in entries.items():
        group, index = name.rsplit("_", 1)
        factor[unknowns.groups[group].start + int(index)] = deviation
    mean, covariance = np.zeros(unknowns.count), np.outer(factor, factor)
    return drawn_ropes(rod, unknowns, mean, np.tril(covariance), seed=3)


def test_grips_that_shift_together_take_as_much_as_the_farthest_draw(beside_a_wall) -> None:
    problem, path = beside_a_wall
    # Both grips hold the rope beside their y axis, which lies across the wall or along it.
    frames = [grip.apply(np.eye(3)[k]) - grip.position for grip in problem.grips for k in range(3)]
    axis = int(np.argmax(np.abs([frame[1] for frame in frames[:3]])))
    ropes = drawn(
        problem.rod,
        **{f"grip_offset_{axis}": DEVIATION, f"grip_offset_{axis + 3}": DEVIATION},
    )
    assert len(ropes) == DRAWS
    shifts = np.array([rope.held[0].position[axis] for rope in ropes])
    np.testing.assert_allclose(shifts, [rope.held[1].position[axis] for rope in ropes])
    towards = np.max(shifts * frames[axis][1])
    # The nearest of 99 normal numbers is where another one comes beyond with 1 %.
    assert 1.9 * DEVIATION < towards < 3.4 * DEVIATION
    certain = certain_clearance(replace(problem, drawn=ropes), path)
    grippers = path.clearance
    rope = min(_clearance(problem, path, rope) for rope in ropes)
    assert certain == pytest.approx(min(grippers, rope), abs=5e-5)
    alone = _clearance(problem, path, DrawnRope(problem.rod, (UNMOVED, UNMOVED)))
    assert alone - rope == pytest.approx(towards, abs=1e-4)


def _clearance(problem: Problem, path: WholePath, rope: DrawnRope) -> float:
    nodes = driven_rope(problem, path, rope)
    assert nodes is not None
    (wall,) = problem.obstacles
    return float(wall.position[1] - 0.1 - np.max(nodes[:, :, 1])) - problem.radius


def test_rope_as_it_is_believed_follows_its_own_path(beside_a_wall) -> None:
    problem, path = beside_a_wall
    nodes = driven_rope(problem, path, DrawnRope(problem.rod, (UNMOVED, UNMOVED)))
    assert nodes is not None
    np.testing.assert_allclose(nodes, path.nodes, atol=1e-5)


def test_nothing_is_taken_where_all_is_known_or_a_draw_is_impossible(beside_a_wall) -> None:
    problem, path = beside_a_wall
    assert certain_clearance(problem, path) == path.clearance
    short = problem.rod.with_properties(replace(problem.rod.properties, length=0.1))
    impossible = DrawnRope(short, (UNMOVED, UNMOVED))
    assert driven_rope(problem, path, impossible) is None
    assert certain_clearance(replace(problem, drawn=(impossible,)), path) == path.clearance


def test_longer_rope_comes_closer_to_the_table_by_its_deeper_sag() -> None:
    problem = scenario_problem(load_with("three-cylinders"))
    lowest = np.min(problem.state.positions[:, 2])
    floor = Obstacle("box", (0.0, 0.0, lowest - 0.12), size=(3.0, 3.0, 0.2))
    problem = replace(problem, obstacles=(floor,))
    here = problem.state.positions
    goal = replace(problem.goal, nodes=here, left=problem.grips[0], right=problem.grips[1])
    path = plan(replace(problem, goal=goal))
    ropes = drawn(problem.rod, length_0=0.004)
    longest = max(ropes, key=lambda rope: rope.rod.properties.length).rod
    sag = lowest - np.min(longest.rest(*problem.grips).state.positions[:, 2])
    assert sag > 0.002
    certain = certain_clearance(replace(problem, drawn=ropes), path)
    assert path.clearance - certain == pytest.approx(sag, abs=2e-4)

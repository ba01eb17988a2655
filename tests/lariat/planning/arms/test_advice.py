from __future__ import annotations

from dataclasses import replace

from lariat.planning.arms.advice import helpful_changes
from lariat.planning.arms.arm_check import arm_fault
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.whole_path import plan
from tests.lariat.planning.arms.scenes import AT_THE_GOAL, cell_with


def test_a_move_of_the_base_that_would_help_does_help():
    cell = cell_with(AT_THE_GOAL)
    changes = helpful_changes(cell)
    assert changes[0].startswith("ends.left: ")
    assert "+0.1 m along x" in changes[0]
    x, y, z = cell.ends.left.base_position
    moved = replace(cell.ends.left, base_position=(x + 0.1, y, z))
    problem = scenario_problem(replace(cell, ends=replace(cell.ends, left=moved)))
    path = plan(problem)
    assert path.reached
    assert arm_fault(problem, path) is None

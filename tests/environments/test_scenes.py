from __future__ import annotations

import pytest

from environments.scenes import KINDS, Kind, sample_scene
from lariat.geometry.obstacles import chain_clearance
from lariat.planning.arms.arm_check import goal_fault, start_fault
from lariat.planning.cell_problem import scenario_problem
from lariat.scenario import load
from lariat.scenario.shipped import find

BASE = load(find("three-cylinders"))


def test_scene_is_the_same_for_the_same_number() -> None:
    one, same, other = (sample_scene("boxes", k, 3, BASE) for k in (5, 5, 6))
    assert one == same
    assert one.nodes(one.goal) is not None
    assert one.obstacles != other.obstacles


@pytest.mark.parametrize("kind", KINDS)
def test_goal_keeps_clear_of_the_obstacles(kind: Kind) -> None:
    scene = sample_scene(kind, 1, 0, BASE)
    goal = scene.part_nodes(scene.goal) if kind == "part" else scene.nodes(scene.goal)
    assert goal is not None
    assert chain_clearance(goal, scene.rope.diameter / 2.0, scene.bodies) > 0.01


def test_arms_can_hold_start_and_goal_among_posts() -> None:
    problem = scenario_problem(sample_scene("arms", 0, 5, BASE))
    assert problem.arms is not None
    assert start_fault(problem) is None
    assert goal_fault(problem) is None

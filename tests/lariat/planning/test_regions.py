"""Regions that the rope is kept in: paths go another way, or are refused with the reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from lariat.geometry.obstacles import chain_clearance
from lariat.planning.cell_problem import scenario_problem
from lariat.planning.no_path_proof import proof_of_no_path
from lariat.planning.problem import Problem, WholePath
from lariat.planning.whole_path import plan
from lariat.scenario import Scenario, load
from lariat.scenario.sections import Obstacle, Region

CYLINDERS = load(Path(__file__).parents[3] / "scenarios" / "three-cylinders.toml")
CEILING = 0.34
"""Height up to which the rope may be [m]: 40 mm above the start."""
UNDER_A_CEILING = Region("box", (0.0, 0.0, CEILING / 2.0), size=(1.2, 1.2, CEILING), name="tray")


def across(height: float, thickness: float, regions: tuple[Region, ...] = ()) -> Scenario:
    """Cell with a beam across the straight way, its middle at a height."""
    beam = Obstacle("box", (0.0, 0.01, height), size=(0.9, 0.04, thickness), name="beam")
    return replace(CYLINDERS, obstacles=(beam,), keep_in=regions)


def problem(scenario: Scenario) -> Problem:
    return scenario_problem(scenario)


def highest(path: WholePath) -> float:
    """Height of the highest point of the rope's surface along a path [m]."""
    return float(path.nodes[..., 2].max()) + CYLINDERS.rope.diameter / 2.0


def test_path_that_would_leave_its_region_goes_another_way() -> None:
    free = plan(problem(across(0.27, 0.06)))
    assert free.reached
    assert highest(free) > CEILING + 0.05
    kept = plan(problem(across(0.27, 0.06, (UNDER_A_CEILING,))))
    assert kept.reached, kept.reason
    assert highest(kept) < CEILING - 0.01
    assert kept.clearance > 0.01


def test_where_only_a_way_outside_remains_the_reason_says_so() -> None:
    # The wall stands on the table; between it and the ceiling there are 10 mm, and the region is
    # narrower than the wall.
    narrow = replace(UNDER_A_CEILING, size=(0.8, 1.2, CEILING))
    walled = problem(across(0.165, 0.33, (narrow,)))
    path = plan(replace(walled, planning_time=2.0))
    assert path.blocked
    assert not path.reached
    assert path.final_error > 0.05
    assert highest(path) < CEILING


def test_proof_of_no_path_holds_for_a_region_that_ends_at_a_wall() -> None:
    # Wider than the workspace, and reaching up to where the rope must not be.
    walled = across(0.2, 0.4, (UNDER_A_CEILING,))
    wall = replace(walled.obstacles[0], size=(2.0, 0.04, 0.4))
    closed = replace(walled, obstacles=(wall,))
    limits = replace(closed.limits, workspace=((-0.8, -0.8, 0.01), (0.8, 0.8, 0.6)))
    assert "no path" in proof_of_no_path(problem(replace(closed, limits=limits)))
    opened = replace(closed, limits=limits, keep_in=())
    assert proof_of_no_path(problem(opened)) == ""


def test_a_goal_outside_is_refused_by_name() -> None:
    inside = problem(across(0.27, 0.06))
    low = Region("cylinder", (0.0, -0.2, 0.3), radius=0.3, height=0.6, name="tray")
    path = plan(replace(inside, obstacles=(*inside.obstacles, low.body(0))))
    assert path.reason.startswith("blocked: the goal")
    assert "'tray'" in path.reason


@pytest.mark.parametrize("shape", ["box", "cylinder"])
def test_clearance_of_a_path_counts_the_border_of_its_region(shape: str) -> None:
    region = Region(
        shape,  # pyright: ignore[reportArgumentType]
        (0.0, 0.0, 0.17),
        radius=0.6 if shape == "cylinder" else None,
        height=0.34 if shape == "cylinder" else None,
        size=(1.2, 1.2, 0.34) if shape == "box" else None,
    )
    found = problem(across(0.27, 0.06, (region,)))
    path = plan(found)
    assert path.reached, path.reason
    own = [chain_clearance(n, found.radius, found.regions) for n in path.nodes]
    assert np.min(own) >= path.clearance - 1e-6
    assert np.min(own) > 0.0

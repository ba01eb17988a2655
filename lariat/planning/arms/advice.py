"""Changes of a cell with which its arms can hold the goal: for `lariat check --plan`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from lariat.geometry import poses
from lariat.planning.arms.arm_check import goal_fault, start_fault
from lariat.planning.cell_problem import scenario_problem
from lariat.scenario import SIDES, Scenario, Side

BASE_MOVES = (0.1, 0.2)
"""Distances by which a base is moved on trial [m]."""
ROLLS = (90.0, -90.0, 180.0)
"""Angles by which a grip is turned about the rope's axis on trial [deg]."""
MAX_CHANGES = 3
"""Number of changes that are returned."""


def helpful_changes(scenario: Scenario) -> list[str]:
    """Return single changes, in words, after which every arm can hold start and goal.

    Bases are moved level, and grips turned about the rope's axis at start and goal alike; small
    changes come first. Whether a way leads to the goal then is not looked at.

    Raises:
        ValueError: The rope has no shape at rest at the start or at the goal.
    """
    helpful = []
    for words, changed in _changes(scenario):
        if _holds_goal(changed):
            helpful.append(words)
        if len(helpful) == MAX_CHANGES:
            break
    return helpful


def _holds_goal(scenario: Scenario) -> bool:
    problem = scenario_problem(scenario)
    arms = problem.arms
    driven = sum(scenario.end(side).driver not in ("fixed", "ideal") for side in SIDES)
    # An arm that cannot reach its start is not among them.
    if arms is None or len(arms.arms) < driven:
        return False
    return start_fault(problem) is None and goal_fault(problem) is None


def _changes(scenario: Scenario) -> Iterator[tuple[str, Scenario]]:
    sides = [side for side in SIDES if scenario.end(side).driver not in ("fixed", "ideal")]
    for distance in BASE_MOVES:
        for side in sides:
            for axis, name in enumerate("xy"):
                for sign in (1.0, -1.0):
                    moved = _with_base(scenario, side, axis, sign * distance)
                    yield (
                        f"ends.{side}: move the base by {sign * distance:+.1f} m along {name}",
                        moved,
                    )
    for roll in ROLLS:
        for side in sides:
            words = (
                f"turn the {side} grip by {roll:+.0f} deg about the rope's axis, at start and goal"
            )
            yield words, _with_roll(scenario, side, np.radians(roll))


def _with_base(scenario: Scenario, side: Side, axis: int, distance: float) -> Scenario:
    end = scenario.end(side)
    x, y, z = np.array(end.base_position) + distance * np.eye(3)[axis]
    moved = replace(end, base_position=(float(x), float(y), float(z)))
    return replace(scenario, ends=replace(scenario.ends, **{side: moved}))


def _with_roll(scenario: Scenario, side: Side, angle: float) -> Scenario:
    turn = poses.exponential(np.array([0.0, 0.0, angle]))
    shapes = {}
    for name, shape in (("start", scenario.start), ("goal", scenario.goal)):
        grips = dict(zip(SIDES, scenario.grips(shape), strict=True))
        w, x, y, z = poses.multiply(grips[side].orientation, turn).tolist()
        shapes[name] = replace(shape, **{f"{side}_orientation": (w, x, y, z)})
    return replace(scenario, **shapes)

"""Check of a scenario with the rod: the rope at rest must not touch an obstacle.

It covers the start, the goal and the goals of events; `lariat.scenario.load` checks the values.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError
from lariat.geometry import obstacles as geometry
from lariat.scenario import Scenario, Shape


@dataclass(frozen=True)
class ShapeReport:
    """Clearance of the rope at rest in one shape of the scenario."""

    clearance: float
    """Least distance between the rope's surface and an obstacle other than a support [m]."""
    nearest: str
    """Name of that obstacle; empty without obstacles."""


def check(scenario: Scenario) -> dict[str, ShapeReport]:
    """Check start, goal and the goals of events.

    Raises:
        ConfigurationError: The rope at rest would touch an obstacle, or cannot take a shape.
    """
    shapes = {"start": scenario.start, "goal": scenario.goal}
    for index, shape in enumerate(scenario.next_goals):
        shapes[f"next_goals[{index}]"] = shape
    for index, event in enumerate(scenario.events):
        if event.goal:
            shapes[f"events[{index}].goal"] = event.goal
    return {key: _report(scenario, key, shape) for key, shape in shapes.items()}


def _report(scenario: Scenario, key: str, shape: Shape) -> ShapeReport:
    nodes = scenario.nodes(shape)
    hangs = nodes is None
    if nodes is None:
        nodes = _at_rest(scenario, key, shape)
    radius = scenario.rope.diameter / 2.0
    clearances = {
        body.name: geometry.chain_clearance(nodes, radius, (body,))
        for body in (*scenario.bodies, *scenario.regions)
        if not body.support
    }
    if not clearances:
        return ShapeReport(np.inf, "")
    nearest = min(clearances, key=lambda name: clearances[name])
    clearance = clearances[nearest]
    if clearance < 0.0:
        subject = "the rope at rest between its grips" if hangs else f"nodes = {shape.nodes!r}"
        region = nearest in {body.name for body in scenario.regions}
        where, what = ("outside of region", "region") if region else ("inside obstacle", "obstacle")
        raise ConfigurationError(
            f"{key}: {subject} would be {-1e3 * clearance:.1f} mm {where} {nearest!r}; "
            f"move the shape or the {what}"
        )
    return ShapeReport(clearance, nearest)


def _at_rest(scenario: Scenario, key: str, shape: Shape) -> Float64[np.ndarray, "n 3"]:
    # Imported late: the rod starts a compiler, which a check of values alone does not need.
    from lariat.control.run.goals import GoalFactory
    from lariat.rod import Rod
    from lariat.scenario.rod_properties import rod_properties

    rod = Rod(rod_properties(scenario.rope), scenario.rope.node_count)
    goals = GoalFactory(scenario, rod, scenario.grips(scenario.start))
    # An end that does not rotate keeps the orientation of the start.
    left, right = goals.feasible_grips(*scenario.grips(shape))
    try:
        if shape.part is not None:
            return goals.from_shape(shape).nodes
        return rod.rest(left, right).state.positions
    except ValueError as error:
        raise ConfigurationError(f"{key}: {error}") from error

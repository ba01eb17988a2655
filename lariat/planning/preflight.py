"""Check of a scenario with the rod: the rope at rest must not touch an obstacle.

It covers the start, the goal and the goals of events; `lariat.scenario.load` checks the values.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float64

from lariat.arms.description import with_own_urdfs
from lariat.configuration import ConfigurationError
from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.scenario import SIDES, Scenario, Shape
from lariat.scenario.extensions import extensions_of

if TYPE_CHECKING:
    from lariat.control.run.goals import GoalFactory

REFINEMENT = 4
"""Edges of the rod that stands for an endless number, by each edge of the controller's."""


@dataclass(frozen=True)
class ShapeReport:
    """Clearance of the rope at rest in one shape of the scenario."""

    clearance: float
    """Least distance between the rope's surface and an obstacle other than a support [m]."""
    nearest: str
    """Name of that obstacle; empty without obstacles."""


def check(scenario: Scenario) -> dict[str, ShapeReport]:
    """Check classes from outside, the arms at the start, then the shapes at start and goals.

    Raises:
        ConfigurationError: A class from outside cannot be imported; an arm's description cannot be
            used or its start is out of reach; the rope at rest would touch an obstacle, or cannot
            take a shape.
    """
    for each in extensions_of(scenario):
        each.load()
    if any(scenario.end(side).driver not in ("fixed", "ideal") for side in SIDES):
        # Imported late: only a cell with such an arm needs Pinocchio.
        from lariat.arms.installation import start_joints

        described = with_own_urdfs(scenario)
        for side, start in zip(SIDES, scenario.grips(scenario.start), strict=True):
            start_joints(described, side, start)
    return {key: _report(scenario, key, shape) for key, shape in _shapes(scenario).items()}


def _shapes(scenario: Scenario) -> dict[str, Shape]:
    shapes = {"start": scenario.start, "goal": scenario.goal}
    for index, shape in enumerate(scenario.next_goals):
        shapes[f"next_goals[{index}]"] = shape
    for index, event in enumerate(scenario.events):
        if event.goal:
            shapes[f"events[{index}].goal"] = event.goal
    return shapes


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
        stated = f"nodes = {shape.file!r}" if shape.file else "its nodes"
        subject = "the rope at rest between its grips" if hangs else stated
        region = nearest in {body.name for body in scenario.regions}
        where, what = ("outside of region", "region") if region else ("inside obstacle", "obstacle")
        lies = "" if region else "; an obstacle with support = true may carry the rope"
        raise ConfigurationError(
            f"{key}: {subject} would be {-1e3 * clearance:.1f} mm {where} {nearest!r}; "
            f"move the shape or the {what}{lies}"
        )
    return ShapeReport(clearance, nearest)


def rest_distances(scenario: Scenario) -> dict[str, float]:
    """Return the distance of each goal that is given by nodes from a rest shape within reach.

    It is the mean node distance [m] of the rest shape of the controller's rope that is nearest
    among those that a local search over the grips finds; infinite where it finds none.
    """
    # Imported late: the rod starts a compiler, which a check of values alone does not need.
    from lariat.geometry.obstacles import pack_supports
    from lariat.rod.part_fit import fit_part

    distances = {}
    for key, shape in _shapes(scenario).items():
        nodes = scenario.nodes(shape)
        if key == "start" or nodes is None:
            continue
        goals = _goals(scenario)
        grips = goals.feasible_grips(*scenario.grips(shape))
        counted, supports = np.ones(len(nodes), dtype=bool), pack_supports(scenario.bodies)
        try:
            fit = fit_part(goals.rod, grips, scenario.moves, nodes, counted, shape.turns, supports)
            distances[key] = fit.error
        except ValueError:
            distances[key] = np.inf
    return distances


def resolution_errors(scenario: Scenario) -> dict[str, float]:
    """Return how far the chain of each shape that hangs is from where an endless one would be.

    It is the largest distance [m] between points of equal arc length of the chain and of one with a
    quarter of its edge length, whose own error is a tenth or less. A shape in which the finer rod
    does not come to rest is left out.
    """
    errors = {}
    for key, shape in _shapes(scenario).items():
        if scenario.nodes(shape) is not None or shape.part is not None or shape.route:
            continue
        coarse = _at_rest(scenario, key, shape)
        count = REFINEMENT * (len(coarse) - 1) + 1
        try:
            fine = _at_rest(
                replace(scenario, rope=replace(scenario.rope, node_count=count)), key, shape
            )
        except ConfigurationError:
            continue
        errors[key] = float(np.linalg.norm(fine - polylines.resample(coarse, count), axis=1).max())
    return errors


def _goals(scenario: Scenario) -> GoalFactory:
    from lariat.control.run.goals import GoalFactory

    return GoalFactory.of_scenario(scenario)


def _at_rest(scenario: Scenario, key: str, shape: Shape) -> Float64[np.ndarray, "n 3"]:
    goals = _goals(scenario)
    # An end that does not rotate keeps the orientation of the start.
    left, right = goals.feasible_grips(*scenario.grips(shape))
    try:
        if shape.part is not None or shape.route:
            return goals.from_shape(shape).nodes
        return goals.rod.rest(left, right).state.positions
    except ValueError as error:
        raise ConfigurationError(f"{key}: {error}") from error

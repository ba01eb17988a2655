"""Checks that the parts of a scenario fit together."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError
from lariat.geometry import obstacles as geometry
from lariat.geometry import polylines
from lariat.geometry.obstacle_checks import MAX_OBSTACLES
from lariat.scenario.cameras import check_cameras
from lariat.scenario.goal_table import length_fault
from lariat.scenario.scenario import MAX_LENGTH_ERROR, Scenario
from lariat.scenario.sections import SIDES, Shape, Side

MAX_CHANGES = 200
"""Largest number of goals that follow and events of a scenario [-]."""
MAX_SUPPORT_DEPTH = 0.002
"""Depth to which a shape may penetrate a support [m]."""
MAX_PART = 0.9
"""Largest part of the rope whose shape leaves the rest free, as a fraction of its length [-]."""
MAX_FIXED_END_MOTION = 1e-3
"""Distance between start and goal of a fixed end [m]."""
MAX_HELD_ASIDE = 0.01
"""The same for a goal given by nodes, which show where the gripper truly holds the rope [m]."""


def check(scenario: Scenario) -> None:
    """Check a scenario.

    Raises:
        ConfigurationError: Two parts contradict each other; the text names the first such pair.
    """
    true = scenario.plant_rope
    yields = true.yield_curvature or true.bending_radius or true.inner_friction
    if yields and scenario.plant.model == "mujoco":
        raise ConfigurationError(
            "plant.model = 'mujoco' keeps no bend, and the rope has yield_curvature, "
            "bending_radius or inner_friction; use 'rod' or 'links'"
        )
    names = [o.name for o in (*scenario.bodies, *scenario.regions)]
    if len(names) > MAX_OBSTACLES:
        raise ConfigurationError(
            f"{len(names)} obstacles with the table, more than {MAX_OBSTACLES}; join some to boxes"
        )
    changes = len(scenario.next_goals) + len(scenario.events)
    if changes > MAX_CHANGES:
        raise ConfigurationError(
            f"{changes} next_goals and events, more than {MAX_CHANGES}; divide the scenario"
        )
    for name in names:
        if names.count(name) > 1:
            raise ConfigurationError(f"two obstacles have the name {name!r}; give each its own")
    if scenario.regions and scenario.control.method in ("network", "actions"):
        raise ConfigurationError(
            f"control.method = {scenario.control.method!r}, the paper's, knows no keep_in; use "
            "'gauss_newton'"
        )
    check_cameras(scenario.sensing, scenario.cameras)
    markers = [o.marker for o in scenario.obstacles if o.marker is not None]
    for marker in markers:
        if markers.count(marker) > 1:
            raise ConfigurationError(f"two obstacles have marker {marker}; give each its own")
    if term := scenario.start.leaves_free or "route" * bool(scenario.start.route):
        raise ConfigurationError(f"start.{term}: the start is a shape of the whole rope")
    for key in ("start", "goal"):
        _check_shape(scenario, key, getattr(scenario, key))
    for index, shape in enumerate(scenario.next_goals):
        _check_shape(scenario, f"next_goals[{index}]", shape)
    for index, event in enumerate(scenario.events):
        if event.goal:
            _check_shape(scenario, f"events[{index}].goal", event.goal)
    for side in SIDES:
        if scenario.end(side).driver == "fixed":
            _check_fixed(scenario, side)


def _check_turns(scenario: Scenario, key: str, shape: Shape) -> None:
    if shape.turns != round(shape.turns):
        raise ConfigurationError(
            f"{key}.turns = {shape.turns} must be a whole number; give the rest of the twist by "
            "the orientation of an end"
        )
    rotates = any(scenario.end(side).rotates for side in SIDES)
    if shape.turns != scenario.start.turns and not rotates:
        raise ConfigurationError(
            f"{key}.turns = {shape.turns:g} differs from the start's {scenario.start.turns:g}, but "
            "no end rotates; set ends.right.rotates = true"
        )


def _check_shape(scenario: Scenario, key: str, shape: Shape) -> None:
    _check_turns(scenario, key, shape)
    laid = _laid_nodes(scenario, key, shape) if shape.route else None
    left, right = scenario.grips(shape)
    length = scenario.rope.length
    distance = float(np.linalg.norm(right.position - left.position))
    if distance > length * scenario.limits.overstretch:
        raise ConfigurationError(
            f"{key}: its ends are {distance:.4f} m apart, out of reach of a rope of {length} m "
            f"(limit {scenario.limits.overstretch} of it); bring them closer"
        )
    nodes = scenario.nodes(shape)
    if nodes is not None and (fault := length_fault(nodes, length, MAX_LENGTH_ERROR)):
        raise ConfigurationError(f"{key}.nodes{f' = {shape.file!r}' * bool(shape.file)} is {fault}")
    points = np.array([left.position, right.position]) if nodes is None else nodes
    points = points if laid is None else laid
    part = scenario.part_nodes(shape)
    if shape.part is not None:
        check_part(scenario, key, shape.part)
    if part is not None and shape.part is not None:
        _check_part_length(key, shape.part, polylines.length(part))
        points = part
    for body in (*scenario.bodies, *scenario.regions):
        depth = scenario.rope.diameter / 2.0 - float(np.min(geometry.signed_distance(points, body)))
        if depth > (MAX_SUPPORT_DEPTH if body.support else 0.0):
            if body.keep_in:
                raise ConfigurationError(
                    f"{key} leaves the region {body.name!r} (by {1e3 * depth:.1f} mm with the "
                    "rope's radius); move the shape, or widen the region"
                )
            raise ConfigurationError(
                f"{key} lies inside obstacle {body.name!r} ({1e3 * depth:.1f} mm deep with the "
                "rope's radius); move the shape or the obstacle"
            )
    low, high = np.array(scenario.limits.workspace)
    for side, pose in (("left", left), ("right", right)):
        if np.any(pose.position < low) or np.any(pose.position > high):
            raise ConfigurationError(
                f"{key}: the {side} grip at {pose.position.round(4).tolist()} m is outside "
                f"limits.workspace = {[list(c) for c in scenario.limits.workspace]}"
            )


def _laid_nodes(scenario: Scenario, key: str, shape: Shape) -> Float64[np.ndarray, "n 3"]:
    try:
        return scenario.laid_nodes(shape)
    except ConfigurationError as error:
        raise ConfigurationError(f"{key}: {error}") from error


def check_part(scenario: Scenario, key: str, part: tuple[float, float]) -> None:
    """Check that a part of the rope lies on it and leaves something free.

    Args:
        scenario: The cell.
        key: Name of the shape, for the message.
        part: Distances of its ends from the left grip [m].

    Raises:
        ConfigurationError: It does not.
    """
    length, part_length = scenario.rope.length, part[1] - part[0]
    if part[1] > length or part_length > MAX_PART * length:
        raise ConfigurationError(
            f"{key}.part = {list(part)} m is more than {MAX_PART:g} of a rope of {length} m, or "
            "beyond its end; without part, the whole rope counts"
        )


def _check_part_length(key: str, part: tuple[float, float], part_length: float) -> None:
    stated = part[1] - part[0]
    if abs(part_length - stated) > MAX_LENGTH_ERROR * stated:
        raise ConfigurationError(
            f"{key}.nodes is {part_length:.4f} m long, {key}.part {stated:.4f} m; scale the shape "
            "or correct the part"
        )


def _check_fixed(scenario: Scenario, side: Side) -> None:
    index = SIDES.index(side)
    start, goal = (scenario.grips(s)[index] for s in (scenario.start, scenario.goal))
    distance = float(np.linalg.norm(start.position - goal.position))
    if distance > (MAX_HELD_ASIDE if scenario.goal.nodes else MAX_FIXED_END_MOTION):
        raise ConfigurationError(
            f"ends.{side} is fixed, but the goal has that end {1e3 * distance:.1f} mm away from "
            "the start; give both the same end or choose another driver"
        )

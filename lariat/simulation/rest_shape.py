"""Rest shape of a scenario's true rope, as a file of nodes that a goal can name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.configuration import ConfigurationError
from lariat.geometry.obstacles import pack_supports
from lariat.geometry.poses import Pose
from lariat.rod import Rod
from lariat.scenario import SIDES, Scenario
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.factory import build_plant, true_properties
from lariat.simulation.plants.plant import Plant
from lariat.simulation.plants.winding import wind

REST_PERIOD = 0.5
"""Time between two looks at a rope that comes to rest [s]."""
REST_MOTION = 1e-5
"""Largest displacement of a node within `REST_PERIOD` at which the rope is at rest [m]."""
MAX_REST_TIME = 30.0
"""Longest time in which a wound rope must come to rest [s]."""


def rest_shape(
    scenario: Scenario,
    left: Pose | Float64[np.ndarray, "3"] | None = None,
    right: Pose | Float64[np.ndarray, "3"] | None = None,
) -> Float64[np.ndarray, "n 3"]:
    """Return the nodes of the true rope at rest between two grips, as they truly hold it [m].

    A grip that does not rotate has the orientation of the start; the rope has the turns of twist
    of the goal. Where there are supports, it lies on them as a rod does that is laid from above.

    Args:
        scenario: Scenario with the true rope.
        left: Left grip, or its position with the orientation of the goal; by default the goal's.
        right: Likewise the right one.

    Raises:
        ConfigurationError: The grips are further apart than the rope is long, the rope does not
            come to rest, or the goal leaves a grip open that is not given.
    """
    if scenario.goal.leaves_grips_open and (left is None or right is None):
        raise ConfigurationError(
            "the goal is a shape of a part of the rope and leaves the grips open; give --left X Y "
            "Z and --right X Y Z"
        )
    first, last = (
        grip if isinstance(grip, Pose) else _moved(own, grip)
        for own, grip in zip(goal_grips(scenario), (left, right), strict=True)
    )
    plant = build_plant(scenario)
    try:
        plant.reset(first, last, _laid(scenario, first, last))
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    if scenario.goal.turns:
        wind(plant, first, last, scenario.goal.turns)
        _settle(plant, first, last)
    return plant.nodes


def _laid(scenario: Scenario, left: Pose, right: Pose) -> Float64[np.ndarray, "n 3"] | None:
    """Nodes of the rod laid onto the supports, near which a plant's rope rests; None without any.

    Plants begin below their grips, where a rope may lie below a support.
    """
    supports = pack_supports(scenario.bodies)
    if supports is None:
        return None
    rod = Rod(true_properties(scenario), scenario.plant_rope.node_count)
    return rod.rest(left, right, obstacles=supports).state.positions


def goal_grips(scenario: Scenario) -> tuple[Pose, Pose]:
    """Return the grips of a scenario's goal, where what an end cannot move is that of the start."""
    grips = zip(SIDES, scenario.grips(scenario.start), scenario.grips(scenario.goal), strict=True)
    left, right = (
        Pose(
            (start if scenario.end(side).driver == "fixed" else goal).position,
            (goal if scenario.end(side).rotates else start).orientation,
        )
        for side, start, goal in grips
    )
    return left, right


def _moved(grip: Pose, position: Float64[np.ndarray, "3"] | None) -> Pose:
    return grip if position is None else Pose(np.asarray(position, float), grip.orientation)


def _settle(plant: Plant, left: Pose, right: Pose) -> None:
    """Hold the grips until the rope is at rest."""
    for _ in range(round(MAX_REST_TIME / REST_PERIOD)):
        before = plant.nodes.copy()
        plant.step(EndMotion(left), EndMotion(right), REST_PERIOD)
        if np.max(np.abs(plant.nodes - before)) < REST_MOTION:
            return
    raise ConfigurationError(
        f"the wound rope does not come to rest within {MAX_REST_TIME:g} s; wind it by fewer turns"
    )


def write_nodes(path: Path, nodes: Float64[np.ndarray, "n 3"], origin: str) -> None:
    """Write a CSV file of nodes.

    Args:
        path: File to write.
        nodes: Node positions [m].
        origin: What the nodes are, for the first line.

    Raises:
        ConfigurationError: The file cannot be written.
    """
    header = f"{origin}\nx, y, z [m]"
    try:
        np.savetxt(path, nodes, fmt="%.6f", delimiter=",", header=header)
    except OSError as error:
        raise ConfigurationError(f"cannot write {path}: {error}") from error

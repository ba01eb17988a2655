"""Rest shape of a scenario's true rope, as a file of nodes that a goal can name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from jaxtyping import Float64

from lariat.geometry.poses import Pose
from services.sim.plants.factory import build_plant
from shared.configuration import ConfigurationError
from shared.scenario import Scenario


def rest_shape(
    scenario: Scenario,
    left: Float64[np.ndarray, "3"] | None = None,
    right: Float64[np.ndarray, "3"] | None = None,
) -> Float64[np.ndarray, "n 3"]:
    """Return the nodes of the true rope at rest between two grips, as they truly hold it [m].

    Args:
        scenario: Scenario; the grips have the orientations of its goal.
        left: Position of the left grip [m]; by default the goal's.
        right: Position of the right grip [m]; by default the goal's.

    Raises:
        ConfigurationError: The grips are further apart than the rope is long.
    """
    grips = scenario.grips(scenario.goal)
    first, last = (
        grip if place is None else Pose(np.asarray(place, float), grip.orientation)
        for grip, place in zip(grips, (left, right), strict=True)
    )
    plant = build_plant(scenario)
    try:
        plant.reset(first, last)
    except ValueError as error:
        raise ConfigurationError(str(error)) from error
    return plant.nodes


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

"""Plant that is driven along a timed path, and what it does there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.geometry.swept_clearance import swept_clearance
from lariat.rod import Rod, RodState, RolloutSpec

PLANT_SUBSTEPS = 4
"""Number of steps of the plant between two points of a path."""
CHUNK_POINTS = 100
"""Number of points of a path that are rolled out in one launch."""
SETTLING_POINTS = 100
"""Number of points at rest after the path."""


@dataclass(frozen=True)
class PlantMotion:
    """Motion of the plant along a path."""

    clearance: float
    """Least distance between the surfaces of rope and obstacles, between the steps too [m]."""
    nodes: Float64[np.ndarray, "n 3"]
    """Nodes at the end, at rest [m]."""


def drive(
    rod: Rod,
    obstacles: Sequence[Obstacle],
    positions: Float64[np.ndarray, "t 2 3"],
    orientations: Float64[np.ndarray, "t 2 4"],
    dt: float,
    least: float = -np.inf,
) -> PlantMotion:
    """Drive the plant along a path, from rest to rest; obstacles are measured, not felt.

    Args:
        rod: The plant.
        obstacles: Obstacles of the scene.
        positions: Positions of the grips [m].
        orientations: Orientations of the grips, wxyz.
        dt: Time between points [s].
        least: Clearance below which the motion ends [m].
    """
    left, right = (Pose(p, q) for p, q in zip(positions[0], orientations[0], strict=True))
    state: RodState = rod.rest(left, right).state
    turns = poses.logarithm(poses.multiply(orientations[1:], poses.conjugate(orientations[:-1])))
    velocities = np.concatenate([np.diff(positions, axis=0), turns], axis=2) / dt
    velocities = np.concatenate([velocities, np.zeros((SETTLING_POINTS, 2, 6))])
    radius, clearance = rod.properties.diameter / 2.0, np.inf
    for first in range(0, len(velocities), CHUNK_POINTS):
        chunk = np.repeat(velocities[first : first + CHUNK_POINTS], PLANT_SUBSTEPS, axis=0)
        rollout = rod.rollout(RolloutSpec(state, chunk, dt / PLANT_SUBSTEPS))
        nodes = np.concatenate([state.positions[None], rollout.positions])
        clearance = min(clearance, swept_clearance(nodes, radius, obstacles))
        state = rollout.final
        if clearance < least:
            break
    return PlantMotion(clearance, state.positions)

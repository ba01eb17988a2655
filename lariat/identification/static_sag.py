"""Stiffness of a cable from its hanging shape and from the twist at which it loses stability.

The cable hangs in a plane between two clamps that hold it level and point the same way, so that it
makes a loop. Its shapes determine EI per weight. As one clamp rotates about its axis, the loop
leaves its plane gradually and jumps at a critical twist. It does so at about one twisting moment,
which determines GJ / EI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.identification.rod_twin import cubic_weights
from lariat.rod import Rod, RodProperties, RodState, state_along

LEVEL_ORIENTATION = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
"""Orientation of a grip whose axis is the world's x axis."""
NODE_COUNT = 120
"""Nodes of the rod in the place of a cable; soft cables bend within centimetres of their clamps."""
STIFFNESS_GRID = np.geomspace(1e-6, 1.0, 25)
"""Values of EI / (weight per length times length^3) in the search [-]."""
COARSE_TWIST_STEP = math.radians(30.0)
"""Rotation of the clamp between two equilibria, until the first jump [rad]."""
FINE_TWIST_STEP = math.radians(2.0)
"""Rotation of the clamp between two equilibria, to locate the jump [rad]."""
MAX_TURNS = 20.0
"""Turns of the clamp above which a loop counts as stable [-]."""
MAX_RATIO_ITERATIONS = 8
"""Largest number of iterations of the search for a twist ratio."""
JUMP_DISPLACEMENT = 0.04
"""Displacement between two equilibria above which the loop has jumped, in lengths [-]."""


@dataclass(frozen=True)
class HangingShape:
    """Measured shape of a hanging cable in its plane, y downwards, from clamp to clamp."""

    points: Float64[np.ndarray, "k 2"]
    """Points on the cable, as dense as its arc length requires [m]."""
    linear_density: float
    """Linear density [kg/m]."""

    @property
    def arcs(self) -> Float64[np.ndarray, "k"]:
        """Arc lengths of the points [m]."""
        return polylines.arc_lengths(self.points)


@dataclass(frozen=True)
class HangingRod:
    """Rod in the place of a hanging cable."""

    rod: Rod
    """The rod."""
    state: RodState
    """Its equilibrium."""
    points: Float64[np.ndarray, "k 2"]
    """Points on the rod at the arc lengths of the measured ones [m]."""


def hang(shape: HangingShape, bending: float, twist_ratio: float = 1.0) -> HangingRod:
    """Find the equilibrium of a rod between the clamps of a shape, starting at the shape.

    Args:
        shape: Measured shape.
        bending: Bending stiffness EI [N m^2].
        twist_ratio: Ratio GJ / EI [-].
    """
    arcs = shape.arcs
    edge = arcs[-1] / (NODE_COUNT - 1)
    properties = RodProperties(arcs[-1], 0.006, shape.linear_density, 1e7)
    properties = properties.with_stiffness(bending, twist_ratio * bending)
    rod = Rod(properties, NODE_COUNT, tolerance=1e-9)
    points = np.stack([shape.points[:, 0], np.zeros(len(arcs)), -shape.points[:, 1]], axis=1)
    left, right = (Pose(point, LEVEL_ORIENTATION) for point in points[[0, -1]])
    arcs_at_nodes = edge * np.arange(NODE_COUNT)
    start = np.stack([np.interp(arcs_at_nodes, arcs, points[:, c]) for c in range(3)], axis=1)
    state = rod.rest(
        left, right, guess=state_along(start, LEVEL_ORIENTATION, LEVEL_ORIENTATION)
    ).state
    on_rod = cubic_weights(arcs / edge, NODE_COUNT) @ state.positions
    return HangingRod(rod, state, np.stack([on_rod[:, 0], -on_rod[:, 2]], axis=1))


def shape_error(shape: HangingShape, bending: float) -> float:
    """Return the mean distance between the points of a cable and those of a rod [m]."""
    offsets = hang(shape, bending).points - shape.points
    return float(np.mean(np.linalg.norm(offsets, axis=1)))


def bending_stiffness(shapes: Sequence[HangingShape]) -> float:
    """Return the EI at which a rod hangs nearest to all shapes [N m^2]."""

    def error(bending: float) -> float:
        return sum(shape_error(shape, bending) for shape in shapes)

    first = shapes[0]
    unit = 9.81 * first.linear_density * first.arcs[-1] ** 3
    coarse = [error(unit * value) for value in STIFFNESS_GRID]
    k = int(np.clip(np.argmin(coarse), 1, len(STIFFNESS_GRID) - 2))
    low, high = (math.log(unit * STIFFNESS_GRID[i]) for i in (k - 1, k + 1))
    # Golden section search: the error is unimodal near its minimum.
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > 1e-3:
        a, b = high - golden * (high - low), low + golden * (high - low)
        if error(math.exp(a)) < error(math.exp(b)):
            high = b
        else:
            low = a
    return math.exp(0.5 * (low + high))


def critical_twist(hanging_rod: HangingRod) -> float:
    """Return the rotation of the right clamp at which the loop jumps, or infinity [rad]."""
    state, twist = hanging_rod.state, 0.0
    while twist < MAX_TURNS * 2.0 * math.pi:
        after = _rotate_clamp(hanging_rod.rod, state, COARSE_TWIST_STEP)
        if _jumped(hanging_rod.rod, state, after):
            break
        state, twist = after, twist + COARSE_TWIST_STEP
    else:
        return math.inf
    while True:
        after = _rotate_clamp(hanging_rod.rod, state, FINE_TWIST_STEP)
        if _jumped(hanging_rod.rod, state, after):
            return twist + 0.5 * FINE_TWIST_STEP
        state, twist = after, twist + FINE_TWIST_STEP


def twist_ratio(shape: HangingShape, bending: float, twist: float) -> float:
    """Return GJ / EI of a cable whose loop jumps at a twist [-].

    For a loop of constant shape the twist is inversely proportional to the ratio; a few iterations
    account for its change of shape.

    Args:
        shape: Hanging shape of the cable.
        bending: Bending stiffness EI [N m^2].
        twist: Critical twist [rad].
    """
    ratio = 1.0
    for _ in range(MAX_RATIO_ITERATIONS):
        factor = critical_twist(hang(shape, bending, ratio)) / twist
        ratio *= factor
        if abs(factor - 1.0) < 0.5 * FINE_TWIST_STEP / twist:
            break
    return ratio


def _rotate_clamp(rod: Rod, state: RodState, angle: float) -> RodState:
    steps = 6
    durations = np.concatenate([np.full(steps, 0.5), 0.5 * 2.0 ** np.arange(14)])
    actions = np.zeros((len(durations), 2, 6))
    actions[:steps, 1, 3] = angle / (0.5 * steps)
    return rod.settle(state, actions, durations)[0].final.at_rest()


def _jumped(rod: Rod, before: RodState, after: RodState) -> bool:
    displacement = np.max(np.linalg.norm(after.positions - before.positions, axis=1))
    return bool(displacement > JUMP_DISPLACEMENT * rod.properties.length)

"""Stiffness of a cable from how it hangs, and from how far it can be twisted.

The cable hangs in a plane between two clamps that hold it level and point the same way, so that it
makes a loop. Its shapes tell EI per weight. Turned about its axis at one clamp, the loop leaves its
plane little by little and at some twist jumps. That happens at about one twisting moment, which
tells GJ / EI.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.rod import Rod, RodProperties, RodState, RolloutSpec, framed
from lariat.rod.identification.rod_twin import cubic_weights

LEVEL = poses.rotation_between(np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0]))
NODES = 60
SEARCH = np.geomspace(1e-6, 1.0, 25)
"""EI / (weight per length times length^3) [-]."""
TURN = math.radians(30.0)
"""Of the clamp between two shapes at rest, on the way to the jump [rad]."""
FINE = math.radians(2.0)
MOST_TURNS = 20.0
ROUNDS = 8
JUMP = 0.04
"""Way of a node from one such shape to the next, relative to length, that is a jump [-]."""


@dataclass(frozen=True)
class Hanging:
    """A cable's shape in its plane, y downwards, from clamp to clamp."""

    points: Float64[np.ndarray, "k 2"]
    """At known distances along the cable [m]."""
    linear_density: float
    """[kg/m]."""

    @property
    def arcs(self) -> Float64[np.ndarray, "k"]:
        """Along the cable [m]."""
        return polylines.arc_lengths(self.points)


@dataclass(frozen=True)
class Hung:
    """A rod in the place of such a cable."""

    rod: Rod
    state: RodState
    points: Float64[np.ndarray, "k 2"]
    """Where the cable's points are on the rod [m]."""


def hang(shape: Hanging, bending: float, twist_ratio: float = 1.0) -> Hung:
    """Lets a rod come to rest between the clamps of a shape, beginning at the shape.

    Args:
        bending: EI [N m^2].
        twist_ratio: GJ / EI [-].
    """
    arcs = shape.arcs
    # A clamp acts at the middle of the edge that it holds.
    edge = arcs[-1] / (NODES - 2)
    properties = RodProperties(arcs[-1] + edge, 0.006, shape.linear_density, 1e7)
    properties = properties.with_stiffness(bending, twist_ratio * bending)
    rod = Rod(properties, NODES, tolerance=1e-9)
    points = np.stack([shape.points[:, 0], np.zeros(len(arcs)), -shape.points[:, 1]], axis=1)
    half = np.array([0.5 * edge, 0.0, 0.0])
    left, right = Pose(points[0] - half, LEVEL), Pose(points[-1] + half, LEVEL)
    at = np.clip((np.arange(NODES) - 0.5) * edge, 0.0, arcs[-1])
    start = np.stack([np.interp(at, arcs, points[:, c]) for c in range(3)], axis=1)
    start[0], start[-1] = left.position, right.position
    state = rod.rest(left, right, guess=framed(start, LEVEL, LEVEL)).state
    seen = cubic_weights(arcs / edge + 0.5, NODES) @ state.positions
    return Hung(rod, state, np.stack([seen[:, 0], -seen[:, 2]], axis=1))


def shape_error(shape: Hanging, bending: float) -> float:
    """Mean distance of the cable's points from those of the rod [m]."""
    away = hang(shape, bending).points - shape.points
    return float(np.mean(np.linalg.norm(away, axis=1)))


def bending_stiffness(shapes: Sequence[Hanging]) -> float:
    """The EI at which a rod hangs nearest to all shapes [N m^2]."""

    def error(bending: float) -> float:
        return sum(shape_error(shape, bending) for shape in shapes)

    first = shapes[0]
    unit = 9.81 * first.linear_density * first.arcs[-1] ** 3
    coarse = [error(unit * value) for value in SEARCH]
    k = int(np.clip(np.argmin(coarse), 1, len(SEARCH) - 2))
    low, high = (math.log(unit * SEARCH[i]) for i in (k - 1, k + 1))
    # Golden section: near its least the error has one valley.
    golden = 0.5 * (math.sqrt(5.0) - 1.0)
    while high - low > 1e-3:
        a, b = high - golden * (high - low), low + golden * (high - low)
        if error(math.exp(a)) < error(math.exp(b)):
            high = b
        else:
            low = a
    return math.exp(0.5 * (low + high))


def critical_twist(hung: Hung) -> float:
    """Turn of the right clamp at which the loop jumps [rad]; infinite when it never does."""
    state, turned = hung.state, 0.0
    while turned < MOST_TURNS * 2.0 * math.pi:
        after = _turned(hung.rod, state, TURN)
        if _jumped(hung.rod, state, after):
            break
        state, turned = after, turned + TURN
    else:
        return math.inf
    while True:
        after = _turned(hung.rod, state, FINE)
        if _jumped(hung.rod, state, after):
            return turned + 0.5 * FINE
        state, turned = after, turned + FINE


def twist_ratio(shape: Hanging, bending: float, twist: float) -> float:
    """GJ / EI of a cable whose loop jumps at a twist [rad].

    Were the loop to keep its shape, the twist would be inversely proportional to the ratio; a few
    rounds make up for how it leans over.
    """
    ratio = 1.0
    for _ in range(ROUNDS):
        factor = critical_twist(hang(shape, bending, ratio)) / twist
        ratio *= factor
        if abs(factor - 1.0) < 0.5 * FINE / twist:
            break
    return ratio


def _turned(rod: Rod, state: RodState, angle: float) -> RodState:
    steps = 6
    durations = np.concatenate([np.full(steps, 0.5), 0.5 * 2.0 ** np.arange(14)])
    actions = np.zeros((len(durations), 2, 6))
    actions[:steps, 1, 3] = angle / (0.5 * steps)
    return rod.settle(RolloutSpec(state, actions, durations))[0].final.at_rest()


def _jumped(rod: Rod, before: RodState, after: RodState) -> bool:
    way = np.max(np.linalg.norm(after.positions - before.positions, axis=1))
    return bool(way > JUMP * rod.properties.length)

"""Set: wires that are bent round and let go, bent back, and hung up by one end.

The share of a curvature that a wire keeps has a closed form for an elastic-perfectly plastic
section, and the layers have one for any history of pure bending.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from jaxtyping import Float64
from scipy.optimize import brentq

from benchmarks.physics.cases import Case
from benchmarks.physics.closed_forms import WEIGHTLESS
from lariat.geometry import poses
from lariat.rod import Rod, RodProperties, RodState
from lariat.rod.properties import Section

WIRE = RodProperties(0.2, 0.003, 0.02, 1e8, yield_curvature=2.0)
"""Wire that is bent round."""
HUNG = RodProperties(0.3, 0.003, 0.05, 1e9, yield_curvature=1.5)
"""Wire that hangs from one end; its weight bends it up to four times as much as it begins to
yield at."""
HISTORY = (6.0, -7.0, 3.0, 8.0)
"""Curvatures to which a wire is bent one after the other [1/m]."""
BENDING_STEPS, LONG = 20, 1e3
"""Number of steps without inertia between two curvatures, and the duration of one [s]."""
RELEASE = np.geomspace(0.05, 1e5, 14)
"""Durations of the steps without inertia in which a wire is let go [s]."""


def kept_share(share: float, section: Section) -> float:
    """Return the share of a curvature that an elastic-perfectly plastic wire keeps [-].

    `share` is the curvature at which it begins to yield, over the one to which it is bent.
    """
    if section == "rectangular":
        return 1.0 - 1.5 * share + 0.5 * share**3
    root = math.sqrt(1.0 - share**2)
    moment = math.asin(share) / share + root * (5.0 / 3.0 - 2.0 * share**2 / 3.0)
    return 1.0 - share * 2.0 / math.pi * moment


def layered_moment(properties: RodProperties, curvatures: Sequence[float]) -> float:
    """Return the moment of a wire over its stiffness after curvatures one after the other [1/m]."""
    share, limit, _ = properties.layers.T
    kept = np.zeros(len(share))
    for curvature in curvatures:
        left = curvature - kept
        kept += left - np.clip(left, -limit, limit)
    return float(curvatures[-1] - share @ kept)


def bend_round(properties: RodProperties, curvatures: Sequence[float], node_count: int) -> RodState:
    """Return a wire whose ends were led along circles of curvatures, one after the other [1/m]."""
    rod = Rod(properties, node_count, gravity=WEIGHTLESS, tolerance=1e-10)
    state, last = rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), 0.0
    for curvature in curvatures:
        path = np.linspace(last, curvature, BENDING_STEPS + 1)
        actions = np.zeros((BENDING_STEPS, 2, 6))
        chord = properties.length * np.sinc(0.5 * path * properties.length / np.pi)
        half = 0.5 * path * properties.length
        ends = np.stack([chord * np.cos(half), 0.0 * half, chord * np.sin(half)], axis=1)
        actions[:, 1, :3] = np.diff(ends, axis=0) / LONG
        actions[:, 1, 4] = -np.diff(2.0 * half) / LONG
        state, last = _settled(rod, state, actions, np.full(BENDING_STEPS, LONG)), curvature
    return state


def left_curvature(wire: RodProperties, curvatures: Sequence[float], node_count: int) -> float:
    """Return what is left of curvatures in the middle of a wire whose right end is let go [1/m]."""
    state = bend_round(wire, curvatures, node_count)
    kept = state.plastic_curvature
    rod = Rod(wire, node_count, right="free", gravity=WEIGHTLESS, tolerance=1e-10)
    freed = RodState(
        state.positions,
        state.orientations[:-1],
        state.velocities,
        state.angular_velocities[:-1],
        plastic_curvature=None if kept is None else kept[:-1],
    )
    state = _settled(rod, freed, np.zeros((len(RELEASE), 2, 6)), RELEASE)
    return middle_curvature(state, wire.length)


def middle_curvature(state: RodState, length: float) -> float:
    """Return the curvature about y in the middle of a wire [1/m]."""
    q, count = state.orientations, len(state.positions)
    middle = len(q) // 2
    turn = poses.logarithm(poses.multiply(poses.conjugate(q[middle]), q[middle + 1]))
    return float(np.linalg.norm(turn[:2]) * (count - 1) / length)


def hang(node_count: int) -> tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]:
    """Return where the free end of a wire is that hangs from the other, and where without weight
    afterwards [m]."""
    ends, state = [], None
    for gravity in (9.81, 0.0):
        rod = Rod(HUNG, node_count, right="free", gravity=(0.0, 0.0, -gravity), tolerance=1e-11)
        state = state or rod.straight((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
        state = _settled(rod, state, np.zeros((len(RELEASE), 2, 6)), RELEASE)
        ends.append(state.positions[-1])
    return ends[0], ends[1]


def _settled(
    rod: Rod,
    state: RodState,
    actions: Float64[np.ndarray, "H 2 6"],
    durations: Float64[np.ndarray, "H"],
) -> RodState:
    motion, _stable = rod.settle(state, actions, durations)
    if not motion.converged.all():
        raise RuntimeError(f"a step of a wire of {rod.node_count} nodes did not converge")
    return motion.final


def springback_error(share: float, section: Section, node_count: int) -> float:
    """Return the error of the share of a curvature that is left [-]."""
    wire = replace(WIRE, section=section)
    left = left_curvature(wire, [wire.yield_curvature / share], node_count)
    return abs(left * share / wire.yield_curvature - kept_share(share, section))


def history_error(
    node_count: int, curvatures: Sequence[float] = HISTORY, wire: RodProperties = WIRE
) -> float:
    """Return the error of what is left of the last of several curvatures, over it [-]."""
    left, last = left_curvature(wire, curvatures, node_count), curvatures[-1]
    unloaded = brentq(lambda back: layered_moment(wire, [*curvatures, back]), -abs(last), abs(last))
    return abs(left - abs(unloaded)) / abs(last)


def hung_error(released: bool, node_count: int) -> float:
    """Return the distance of a hung wire's end from that of a wire of 641 nodes [mm]."""
    error = hang(node_count)[released] - hang(641)[released]
    return 1e3 * float(np.linalg.norm(error))


CASES: tuple[Case, ...] = (
    *(
        Case(
            f"{section} wire, {share:g}",
            "-",
            partial(springback_error, share, section),
            (10, 20, 40),
            {20: 0.01, 40: 0.01},
        )
        for section in ("round", "rectangular")
        for share in (0.2, 0.35, 0.5, 0.65, 0.8, 0.9)
    ),
    Case("bent there and back", "-", history_error, (10, 20, 40), {40: 0.002}),
    *(
        Case(f"hung up, {name}", "mm", partial(hung_error, released), (11, 21, 41, 81), {}, 1.8)
        for name, released in (("under its weight", False), ("without it again", True))
    ),
)

"""Whip: the handle of a tapered rod is flicked and stopped, and its free tip becomes fast.

Gravity and the work of the handle are the only sources of energy, and there is no damping: once the
handle stands still, energy is conserved. The time step is proportional to the length of an edge.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Float64

from benchmarks.physics.convergence import Case, Error
from benchmarks.physics.elasticae import level_grip
from benchmarks.physics.energy import energy, kinetic
from lariat.rod import Rod, RodProperties, RolloutSpec

WHIP = RodProperties(
    1.2, 0.008, 0.05, 4e6, damping=0.0, stiffness_profile=(2.0, 0.1), density_profile=(1.6, 0.4)
)
"""Tapered whip."""
NODE_COUNTS = (20, 40, 80, 160)
"""Numbers of nodes of the whips."""
STEP_PER_EDGE = 0.02
"""Time step over the length of an edge [s/m]."""
FLICK_ANGLE = math.radians(120.0)
"""Angle by which the handle turns [rad]."""
FLICK_DURATION, FREE_DURATION = 0.15, 0.25
"""Duration of the flick, and of the motion after it [s]."""
MAX_ENERGY_ERROR = 1.0
"""Largest allowed change of energy at n = 80, relative to the kinetic energy [%]."""


@dataclass(frozen=True)
class Crack:
    """Motion of a whip."""

    positions: Float64[np.ndarray, "H n 3"]
    """Node positions over time [m]."""
    tip_speeds: Float64[np.ndarray, "H"]
    """Speed of the tip [m/s]."""
    energies: Float64[np.ndarray, "k"]
    """Energies while the handle stands still [J]."""
    kinetic: float
    """Kinetic energy when the handle stops [J]."""


def energy_error(node_count: int) -> Error:
    """Return the largest change of energy after the flick, relative to the kinetic energy [%]."""
    crack = flick(node_count)
    change = np.max(np.abs(crack.energies - crack.energies[0]))
    return Error(float(100.0 * change / crack.kinetic))


@cache
def flick(node_count: int) -> Crack:
    """Simulate a whip."""
    rod = Rod(WHIP, node_count, right="free", tolerance=1e-9, scheme="sdirk2")
    handle = level_grip(0.0, pitch=60.0)
    rest = rod.rest(handle, handle).state
    dt = STEP_PER_EDGE * rod.edge_length
    turning, free = (max(1, round(t / dt)) for t in (FLICK_DURATION, FREE_DURATION))
    phase = np.linspace(0.0, 1.0, turning + 1)
    # The angle rises smoothly, with neither velocity nor acceleration at both ends.
    angles = FLICK_ANGLE * (phase - np.sin(2.0 * np.pi * phase) / (2.0 * np.pi))
    actions = np.zeros((turning, 2, 6))
    actions[:, 0, 4] = np.diff(angles) / dt
    driven = rod.rollout(RolloutSpec(rest, actions, dt))
    still = np.zeros((1, 2, 6))
    state, energies, positions = driven.final, [energy(rod, driven.final)], [driven.positions]
    start = kinetic(rod, state)
    for _ in range(free):
        moved = rod.rollout(RolloutSpec(state, still, dt))
        state = moved.final
        energies.append(energy(rod, state))
        positions.append(moved.positions)
    path = np.concatenate(positions)
    speeds = np.linalg.norm(np.diff(path[:, -1], axis=0), axis=1) / dt
    return Crack(path, speeds, np.array(energies), start)


CASES: tuple[Case, ...] = (
    Case("whip, energy", "%", energy_error, NODE_COUNTS, {80: MAX_ENERGY_ERROR}),
)
"""Cases of the table."""

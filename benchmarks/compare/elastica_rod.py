# pyright: reportMissingImports=false, reportPrivateImportUsage=false, reportIncompatibleMethodOverride=false
"""Contender: PyElastica, a Cosserat rod with explicit steps.

A short element in each grip, beyond the end of the rope, gives the direction of the clamp: the bend
between it and the rope's first element acts over half an element. In the limit this is the clamp of
the continuum that all solvers are compared with. Stretch and shear as stiff as modulus and
cross-section say, a fortieth of `PROPERTIES`, allow longer steps: marked `E A`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import elastica
import numpy as np
from jaxtyping import Float64

from benchmarks.compare.motion import (
    ACTION_DURATION,
    PROPERTIES,
    Contender,
    DampedSimulation,
    Moves,
    NodePath,
    grip_path,
    rest_state,
    then_still,
)
from lariat.geometry import poses

GRIP_ELEMENT_RATIO = 1e-3
"""Length of the element in a grip, relative to the others [-]."""
SOFT_STEP_COUNT = 100
"""Steps in an action with soft stretch."""


def contenders() -> Iterator[Contender]:
    """Yield the rod, soft and stiff, in about the longest steps that are stable."""
    for n in (20, 40, 80):
        yield rod(n, SOFT_STEP_COUNT, stiff=False)
    yield rod(80, 1000, stiff=True)


def rod(n: int, steps: int, stiff: bool) -> Contender:
    """Return the rod with a number of steps in an action."""
    step = ACTION_DURATION / steps
    return Contender(
        "PyElastica",
        n,
        f"{1e3 * step:.2g} ms{'' if stiff else ', E A'}",
        lambda moves: _Run(n, step, stiff, moves),
    )


class _Simulator(
    elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping
):
    """Rod with driven ends, gravity and damping."""


class _Drag(elastica.DamperBase):
    """Drag whose strength can be changed."""

    def __init__(self, factor: Float64[np.ndarray, "1"], **given: object) -> None:
        """Store the factor on velocities in a step, which the owner of the array may change."""
        super().__init__(**given)
        self._factor = factor

    def dampen_rates(self, system: elastica.CosseratRod, time: float) -> None:
        """Slow the rod down."""
        del time
        system.velocity_collection *= self._factor
        system.omega_collection *= self._factor


class _Grips(elastica.ConstraintBase):
    """Constraint of the elements in both grips, precomputed for the whole run."""

    def __init__(self, moves: Moves, half: float, length: float, **given: object) -> None:
        """Precompute the motion of elements of a length [m] in the grips, by half steps [s]."""
        super().__init__(**given)
        self._half = half
        positions, turns = grip_path(moves, half)
        rates = np.repeat(moves, round(ACTION_DURATION / half), axis=0)
        # Nodes 0, 1, -2, -1 and the first and last element, at every half step.
        self._positions = np.empty((len(rates), 3, 4))
        self._velocities = np.zeros((len(rates), 3, 4))
        self._frames = np.empty((len(rates), 3, 3, 2))
        self._spins = np.zeros((len(rates), 3, 2))
        for end in range(2):
            outer, inner = (0, 1) if end == 0 else (3, 2)
            position, q = positions[:, end], turns[:, end]
            arm = poses.rotate(q, np.array([0.0, 0.0, length * (2 * end - 1)]))
            frames = poses.matrix(q).transpose(0, 2, 1)
            self._positions[..., outer], self._positions[..., inner] = position + arm, position
            self._frames[..., end] = frames
            v, omega = rates[:, end, :3], rates[:, end, 3:]
            self._velocities[..., outer] = v + np.cross(omega, arm)
            self._velocities[..., inner] = v
            self._spins[..., end] = np.einsum("kij,kj->ki", frames, omega)

    def constrain_values(self, system: elastica.CosseratRod, time: float) -> None:
        """Set positions and frames of the elements in the grips."""
        k = max(round(time / self._half) - 1, 0)
        system.position_collection[:, :2] = self._positions[k, :, :2]
        system.position_collection[:, -2:] = self._positions[k, :, 2:]
        system.director_collection[:, :, 0] = self._frames[k, :, :, 0]
        system.director_collection[:, :, -1] = self._frames[k, :, :, 1]

    def constrain_rates(self, system: elastica.CosseratRod, time: float) -> None:
        """Set velocities of the elements in the grips."""
        k = min(round(time / self._half), len(self._spins) - 1)
        system.velocity_collection[:, :2] = self._velocities[k, :, :2]
        system.velocity_collection[:, -2:] = self._velocities[k, :, 2:]
        system.omega_collection[:, 0] = self._spins[k, :, 0]
        system.omega_collection[:, -1] = self._spins[k, :, 1]


class _Run(DampedSimulation):
    """Run of PyElastica."""

    def __init__(self, n: int, step: float, stiff: bool, moves: Moves) -> None:
        super().__init__(moves)
        p, start = PROPERTIES, rest_state(n)
        radius = 0.5 * p.diameter
        element = p.length / (n - 1)
        in_grip = GRIP_ELEMENT_RATIO * element
        heights = np.array([-in_grip, *(element * np.arange(n)), p.length + in_grip])
        rod = elastica.CosseratRod.straight_rod(
            n + 1,
            np.array([0.0, 0.0, -in_grip]),
            np.array([0.0, 0.0, 1.0]),
            np.array([1.0, 0.0, 0.0]),
            p.length + 2.0 * in_grip,
            radius,
            p.linear_density / (math.pi * radius**2),
            youngs_modulus=p.youngs_modulus,
            shear_modulus=0.5 * p.youngs_modulus / (1.0 + p.poisson_ratio),
            position=np.stack([0.0 * heights, 0.0 * heights, heights]),
        )
        if stiff:
            rod.shear_matrix[:] = (p.stretch_stiffness * np.eye(3))[:, :, None]
        rod.position_collection[:, 1:-1] = start.positions.T
        rod.director_collection[:] = np.stack(
            [poses.matrix(q).T for q in start.orientations], axis=2
        )
        simulator = _Simulator()
        simulator.append(rod)
        simulator.constrain(rod).using(
            _Grips, moves=then_still(moves), half=0.5 * step, length=in_grip
        )
        simulator.add_forcing_to(rod).using(
            elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -9.81])
        )
        self._factor = np.ones(1)
        simulator.dampen(rod).using(_Drag, factor=self._factor)
        simulator.finalize()
        self._rod, self._simulator = rod, simulator
        self._stepper = elastica.PositionVerlet()
        self._step, self._time = step, 0.0

    def _advance(self, count: int, damping: float) -> NodePath:
        self._factor[:] = math.exp(-damping * self._step)
        path = np.empty((count, self._rod.n_nodes - 2, 3))
        for k in range(count):
            for _ in range(round(ACTION_DURATION / self._step)):
                self._time = self._stepper.step(self._simulator, self._time, self._step)
            path[k] = self._rod.position_collection[:, 1:-1].T
        return path

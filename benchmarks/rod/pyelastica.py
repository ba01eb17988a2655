"""The motion of the work-precision diagram by PyElastica, a Cosserat rod with explicit steps.

A short element in each grip, beyond the end of the rope, gives the direction of the clamp: the bend
between it and the rope's first element acts over half an element.
"""

from __future__ import annotations

import math

import elastica  # pyright: ignore[reportMissingImports]
import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties, RodState

GRIP_ELEMENT_RATIO = 1e-3
"""Length of the element in a grip, relative to the others [-]."""


class _Simulator(
    elastica.BaseSystemCollection, elastica.Constraints, elastica.Forcing, elastica.Damping
):
    """Rod with driven ends, gravity and damping."""


class _Grips(elastica.ConstraintBase):
    """Constraint of the elements in both grips, precomputed for the whole run."""

    def __init__(
        self,
        grips: list[Pose],
        moves: Float64[np.ndarray, "H 2 6"],
        dt: float,
        half: float,
        length: float,
        **given: object,
    ) -> None:
        """Precompute the motion of the elements in the grips.

        Args:
            grips: Grips at the start.
            moves: Velocities of the grips.
            dt: Duration of each move [s].
            half: Half a step of the solver [s].
            length: Length of the element in a grip [m].
            given: Arguments of the base class.
        """
        super().__init__(**given)
        self._half = half
        count = round(dt / half)
        rates = np.repeat(moves, count, axis=0)
        since = half * np.arange(1, count + 1)[:, None]
        # Nodes 0, 1, -2, -1 and the first and last element, at every half step.
        self._positions = np.empty((len(rates) + 1, 3, 4))
        self._velocities = np.zeros((len(rates) + 1, 3, 4))
        self._frames = np.empty((len(rates) + 1, 3, 3, 2))
        self._spins = np.zeros((len(rates) + 1, 3, 2))
        for end, grip in enumerate(grips):
            outer, inner = (0, 1) if end == 0 else (3, 2)
            positions, turns = [grip.position[None]], [grip.orientation[None]]
            for action in moves[:, end]:
                positions.append(positions[-1][-1] + since * action[:3])
                turned = poses.exponential(since * action[3:])
                turns.append(poses.multiply(turned, turns[-1][-1]))
            position, q = np.concatenate(positions), np.concatenate(turns)
            arm = poses.rotate(q, np.array([0.0, 0.0, length * (2 * end - 1)]))
            frames = poses.matrix(q).transpose(0, 2, 1)
            self._positions[..., outer], self._positions[..., inner] = position + arm, position
            self._frames[..., end] = frames
            v, omega = rates[:, end, :3], rates[:, end, 3:]
            self._velocities[:-1, :, outer] = v + np.cross(omega, arm[:-1])
            self._velocities[:-1, :, inner] = v
            self._spins[:-1, :, end] = np.einsum("kij,kj->ki", frames[:-1], omega)

    def constrain_values(self, system: elastica.CosseratRod, time: float) -> None:
        """Set positions and frames of the elements in the grips."""
        k = round(time / self._half)
        system.position_collection[:, :2] = self._positions[k, :, :2]
        system.position_collection[:, -2:] = self._positions[k, :, 2:]
        system.director_collection[:, :, 0] = self._frames[k, :, :, 0]
        system.director_collection[:, :, -1] = self._frames[k, :, :, 1]

    def constrain_rates(self, system: elastica.CosseratRod, time: float) -> None:
        """Set velocities of the elements in the grips."""
        k = round(time / self._half)
        system.velocity_collection[:, :2] = self._velocities[k, :, :2]
        system.velocity_collection[:, -2:] = self._velocities[k, :, 2:]
        system.omega_collection[:, 0] = self._spins[k, :, 0]
        system.omega_collection[:, -1] = self._spins[k, :, 1]


def rollout(
    properties: RodProperties,
    start: RodState,
    grips: list[Pose],
    moves: Float64[np.ndarray, "H 2 6"],
    dt: float,
    step: float,
    damping: float,
    stiff: bool,
) -> Float64[np.ndarray, "H n 3"]:
    """Return the positions after every action [m].

    Args:
        properties: Properties of the rod.
        start: State at the start.
        grips: Grips at the start.
        moves: Velocities of the grips.
        dt: Duration of each action [s].
        step: Time step of the solver [s].
        damping: Damping force per velocity and mass [1/s].
        stiff: Whether stretch and shear are as stiff as the properties say; otherwise as E and G
            of the cross-section, which is far softer and allows longer explicit steps.
    """
    count = len(start.positions)
    radius = 0.5 * properties.diameter
    element = properties.length / (count - 1)
    in_grip = GRIP_ELEMENT_RATIO * element
    heights = np.array([-in_grip, *(element * np.arange(count)), properties.length + in_grip])
    rod = elastica.CosseratRod.straight_rod(
        count + 1,
        np.array([0.0, 0.0, -in_grip]),
        np.array([0.0, 0.0, 1.0]),
        np.array([1.0, 0.0, 0.0]),
        properties.length + 2.0 * in_grip,
        radius,
        properties.linear_density / (math.pi * radius**2),
        youngs_modulus=properties.youngs_modulus,
        shear_modulus=0.5 * properties.youngs_modulus / (1.0 + properties.poisson_ratio),
        position=np.stack([0.0 * heights, 0.0 * heights, heights]),
    )
    if stiff:
        rod.shear_matrix[:] = (properties.stretch_stiffness * np.eye(3))[:, :, None]
    rod.position_collection[:, 1:-1] = start.positions.T
    rod.director_collection[:] = np.stack([poses.matrix(q).T for q in start.orientations], axis=2)
    simulator = _Simulator()
    simulator.append(rod)
    simulator.constrain(rod).using(
        _Grips,
        grips=grips,
        moves=moves,
        dt=dt,
        half=0.5 * step,
        length=in_grip,
    )
    simulator.add_forcing_to(rod).using(
        elastica.GravityForces, acc_gravity=np.array([0.0, 0.0, -9.81])
    )
    simulator.dampen(rod).using(
        elastica.AnalyticalLinearDamper, uniform_damping_constant=damping, time_step=step
    )
    simulator.finalize()
    stepper = elastica.PositionVerlet()
    path = np.empty((len(moves), count, 3))
    steps = round(dt / step)
    for k in range(len(moves)):
        time = k * dt
        for _ in range(steps):
            time = stepper.step(simulator, time, step)
        path[k] = rod.position_collection[:, 1:-1].T
    return path

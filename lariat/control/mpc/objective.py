"""Objective of the horizon, as least squares in the response of the rod.

    sum over the horizon of   mean squared node distance to the reference          tracking
                            + speed_weight |w|² + acceleration_weight |w'|²         effort
                            + SWING_TIME² mean squared node velocity off it         swing
                            + (missing clearance of the rope)²                      obstacles
                            + (missing clearance of the grippers' bodies)²          grippers
                            + (rotation from a wanted orientation)²                 orientation

The swing term (key `calm` of the cost) is evaluated at the end of the horizon. w is the velocity of
the grips relative to the reference trajectory, scaled to the rope's displacement where that exceeds
the grip's. The paper's eq. (12) uses the distance itself and a potential; squares converge
quadratically, and a hinge leaves a goal near an obstacle unbiased. Lengths enter in millimetres, so
that every term is in mm².
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from jaxtyping import Bool, Float64

from lariat.control.mpc.collision_avoidance import (
    MILLIMETRE,
    AvoidanceSpecification,
    GripPrediction,
    gripper_clearance_residuals,
    rope_clearance_residuals,
)
from lariat.geometry import poses

SWING_TIME = 0.5
"""Distance that is worth a unit of node speed at the horizon's end [s].

A horizon is shorter than a period of the rope's swinging; without this term a rope that follows
the grips late overshoots its goal by more and more.
"""


@dataclass(frozen=True)
class ObjectiveWeights:
    """Weights of effort against tracking."""

    speed: float = 0.02
    """Weight of squared speed [s^2]."""
    acceleration: float = 2e-4
    """Weight of squared acceleration [s^4]."""
    along: float = 1.0
    """Weight of a node's place along the rope, relative to its distance across it [-]."""


@dataclass(frozen=True)
class NormalEquations:
    """Normal equations J^T J step = -J^T r of the objective at one point."""

    hessian: Float64[np.ndarray, "v v"]
    """Gauss-Newton Hessian J^T J."""
    gradient: Float64[np.ndarray, "v"]
    """Gradient J^T r."""
    cost: dict[str, float]
    """Cost by term [mm^2]."""

    @property
    def total(self) -> float:
        """Cost of all terms [mm^2]."""
        return sum(self.cost.values())


def rope_terms(
    nodes: Float64[np.ndarray, "h n 3"],
    grips: GripPrediction,
    jacobian: Float64[np.ndarray, "h n 3 v"],
    reference: Float64[np.ndarray, "h n 3"],
    avoidance: AvoidanceSpecification,
    dt: float,
    along: float = 1.0,
    counted: Bool[np.ndarray, "n"] | None = None,
) -> NormalEquations:
    """Tracking, swing and collision avoidance: the terms that depend on the rope and its grips.

    Args:
        nodes: Predicted nodes [m].
        grips: Predicted grips.
        jacobian: Derivative of the nodes with respect to the variables.
        reference: Reference nodes [m].
        avoidance: Obstacles and clearances.
        dt: Duration of a step of the horizon [s].
        along: Weight of a node's place along the rope, relative to its distance across it [-].
        counted: Nodes whose distances from the reference count; None for all.
    """
    horizon, count, _, size = jacobian.shape
    offset = nodes - reference
    miss, response = offset, jacobian
    if along < 1.0:
        tangents = poses.normalized(np.gradient(reference, axis=1))
        miss = _less_along(miss[..., None], tangents, along)[..., 0]
        response = _less_along(response, tangents, along)
    if counted is not None:
        miss, response = miss[:, counted], response[:, counted]
    terms = [("tracking", MILLIMETRE**2 / miss.shape[1], miss, response)]
    if horizon > 1:
        weight = (MILLIMETRE * SWING_TIME / dt) ** 2 / count
        terms.append(("calm", weight, offset[-1] - offset[-2], jacobian[-1] - jacobian[-2]))
    terms.append(("obstacles", 1.0, *rope_clearance_residuals(nodes, jacobian, avoidance)))
    terms.append(("grippers", 1.0, *gripper_clearance_residuals(grips, avoidance)))
    hessian, gradient, cost = np.zeros((size, size)), np.zeros(size), {}
    for name, weight, residuals, rows in terms:
        residual, row = residuals.ravel(), rows.reshape(residuals.size, size)
        cost[name] = weight * float(residual @ residual)
        if len(residual):
            hessian += weight * (row.T @ row)
            gradient += weight * (row.T @ residual)
    return NormalEquations(hessian, gradient, cost)


def _less_along(
    vectors: Float64[np.ndarray, "h n 3 v"], tangents: Float64[np.ndarray, "h n 3"], weight: float
) -> Float64[np.ndarray, "h n 3 v"]:
    """Vectors whose components along the rope are scaled by a weight."""
    along = np.matmul(tangents[..., None, :], vectors)
    return vectors - (1.0 - weight) * tangents[..., None] * along


def effort_terms(
    velocities: Float64[np.ndarray, "h m"],
    initial_velocity: Float64[np.ndarray, "m"],
    unit: Float64[np.ndarray, "m"],
    weights: ObjectiveWeights,
    dt: float,
) -> NormalEquations:
    """Speed and acceleration relative to the reference trajectory.

    Args:
        velocities: Velocities at the ends of the horizon's steps [m/s, rad/s].
        initial_velocity: Velocity at the beginning of the horizon [m/s, rad/s].
        unit: Displacement that one unit of each component stands for [m].
        weights: Weights of speed and acceleration.
        dt: Duration of a step of the horizon [s].
    """
    horizon, count = velocities.shape
    scale = MILLIMETRE * unit
    inertia = weights.acceleration / dt**2
    scales, speed = np.tile(scale, horizon), (scale * velocities).ravel()
    begun = scale * initial_velocity
    change = speed - np.concatenate([begun, speed[:-count]])
    matrix = _effort(horizon, count, weights.speed, inertia)
    gradient = matrix @ speed
    gradient[:count] -= inertia * begun
    return NormalEquations(
        matrix * (scales[:, None] * scales),
        scales * gradient,
        {
            "speed": weights.speed * float(speed @ speed),
            "acceleration": inertia * float(change @ change),
        },
    )


@lru_cache
def _effort(
    horizon: int, count: int, speed: float, acceleration: float
) -> Float64[np.ndarray, "v v"]:
    """Matrix of the effort's quadratic form in the velocities at the ends of steps."""
    size = horizon * count
    changes = np.eye(size) - np.eye(size, k=-count)
    return speed * np.eye(size) + acceleration * changes.T @ changes


def orientation_terms(
    velocities: Float64[np.ndarray, "h m"],
    means: Float64[np.ndarray, "h h"],
    rotation: Float64[np.ndarray, "m"],
    oriented: Bool[np.ndarray, "m"],
    unit: Float64[np.ndarray, "m"],
    dt: float,
) -> NormalEquations:
    """Rotation of the grips from the orientations of the goal.

    Args:
        velocities: Velocities at the ends of the horizon's steps [m/s, rad/s].
        means: Matrix that maps them to the mean velocities in the steps.
        rotation: Rotation from the wanted orientation at the beginning [rad], by component.
        oriented: Components whose orientation is part of the goal.
        unit: Displacement that one unit of each component stands for [m].
        dt: Duration of a step of the horizon [s].
    """
    horizon, size = len(velocities), velocities.size
    if not oriented.any():
        return NormalEquations(np.zeros((size, size)), np.zeros(size), {"orientation": 0.0})
    weight = np.diag(MILLIMETRE * unit * oriented)
    travel = dt * np.cumsum(means, axis=0)
    jacobian = np.kron(travel, weight)
    residual = jacobian @ velocities.ravel() + np.tile(weight @ rotation, horizon)
    return NormalEquations(
        jacobian.T @ jacobian, jacobian.T @ residual, {"orientation": float(residual @ residual)}
    )

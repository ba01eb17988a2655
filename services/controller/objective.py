"""What the controller wants of the next moments, as least squares in the rod's response.

    sum over the horizon of   mean node distance² to the reference            tracking
                            + speed_weight |w|² + acceleration_weight |w'|²    effort
                            + (lack of clearance)²                             obstacles, cf. (13)
                            + (rotation from a wanted orientation)²            orientation

w is the velocity of the grips on top of the path's. The paper's (12) takes the distance itself and
a potential; squares converge quadratically, and a hinge leaves a goal near an obstacle unbiased.
Lengths enter in millimetres, so that every term is in mm².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from shared.geometry.clearance import near, with_midpoints
from shared.geometry.obstacles import Obstacle

MILLIMETRE = 1e3
NEARNESS = 2.0
"""Weight of a millimetre of lacking clearance against one of tracking, per pair of points."""


@dataclass(frozen=True)
class Surroundings:
    """What keeps the rope from going anywhere."""

    obstacles: tuple[Obstacle, ...]
    """All that must not be touched."""
    clearance: float
    """Between the rope's surface and theirs [m]."""
    radius: float
    """Of the rope [m]."""
    most_apart: float
    """Of the grips [m]; a constraint, no term of the objective."""
    longest: float = np.inf
    """Length to which the rope may be pulled [m]; a constraint as well."""


@dataclass(frozen=True)
class Weights:
    """Of the objective's terms against tracking."""

    speed: float = 0.02
    """[s^2]"""
    acceleration: float = 2e-4
    """[s^4]"""


@dataclass(frozen=True)
class LeastSquares:
    """Normal equations J^T J step = -J^T r of the objective at one point."""

    hessian: Float64[np.ndarray, "v v"]
    slope: Float64[np.ndarray, "v"]
    cost: dict[str, float]
    """By term [mm^2]."""

    @property
    def total(self) -> float:
        """Cost of all terms [mm^2]."""
        return sum(self.cost.values())


def least_squares(
    nodes: Float64[np.ndarray, "h n 3"],
    slopes: Float64[np.ndarray, "h n 3 v"],
    reference: Float64[np.ndarray, "h n 3"],
    surroundings: Surroundings,
) -> LeastSquares:
    """Tracking and obstacles: the terms that the rope's nodes decide.

    Args:
        nodes: Predicted [m].
        slopes: Of the predicted nodes in the variables.
        reference: Where the nodes should be [m].
    """
    horizon, count = nodes.shape[:2]
    scale = MILLIMETRE / np.sqrt(count)
    rows = [scale * slopes.reshape(3 * horizon * count, -1)]
    residuals = [scale * (nodes - reference).ravel()]
    terms = ["tracking"]
    residual, row = _obstacles(nodes, slopes, surroundings)
    terms.append("obstacles")
    residuals.append(residual)
    rows.append(row)
    jacobian, residual = np.concatenate(rows), np.concatenate(residuals)
    cost = {name: float(r @ r) for name, r in zip(terms, residuals, strict=True)}
    return LeastSquares(jacobian.T @ jacobian, jacobian.T @ residual, cost)


def _obstacles(
    nodes: Float64[np.ndarray, "h n 3"],
    slopes: Float64[np.ndarray, "h n 3 v"],
    surroundings: Surroundings,
) -> tuple[np.ndarray, np.ndarray]:
    """Lack of clearance of nodes and of the middles between them."""
    count = nodes.shape[1]
    points = with_midpoints(nodes).reshape(-1, 3)
    reach = surroundings.clearance + surroundings.radius
    hits = near(points, surroundings.obstacles, np.full(len(points), reach))
    step, at = np.divmod(hits.points, 2 * count - 1)
    first = np.where(at < count, at, at - count)
    second = np.where(at < count, at, at - count + 1)
    here = 0.5 * (slopes[step, first] + slopes[step, second])
    along = np.einsum("ac,acv->av", hits.normals, here)
    weight = MILLIMETRE * NEARNESS
    return weight * (reach - hits.distances), -weight * along


def effort(
    velocities: Float64[np.ndarray, "h m"],
    before: Float64[np.ndarray, "m"],
    unit: Float64[np.ndarray, "m"],
    weights: Weights,
    dt: float,
) -> LeastSquares:
    """Speed and acceleration on top of the path's.

    Args:
        velocities: At the ends of the horizon's steps [m/s, rad/s].
        before: At its beginning.
        unit: Metres for which one unit of each component counts [m].
    """
    horizon, count = velocities.shape
    identity = np.eye(horizon * count)
    scale = np.tile(MILLIMETRE * unit, horizon)
    still = np.sqrt(weights.speed) * scale
    change = identity - np.eye(horizon * count, k=-count)
    change = np.sqrt(weights.acceleration) / dt * scale[:, None] * change
    started = np.sqrt(weights.acceleration) / dt * MILLIMETRE * unit * before
    residual = change @ velocities.ravel()
    residual[:count] -= started
    slow = still * velocities.ravel()
    return LeastSquares(
        np.diag(still**2) + change.T @ change,
        still * slow + change.T @ residual,
        {"speed": float(slow @ slow), "acceleration": float(residual @ residual)},
    )


def orientation(
    velocities: Float64[np.ndarray, "h m"],
    means: Float64[np.ndarray, "h h"],
    turned: Float64[np.ndarray, "m"],
    wanted: Bool[np.ndarray, "m"],
    unit: Float64[np.ndarray, "m"],
    dt: float,
) -> LeastSquares:
    """Rotation of the grips away from the orientations that the goal asks for.

    Args:
        velocities: At the ends of the horizon's steps [m/s, rad/s].
        means: From those to the mean velocities in the steps.
        turned: Rotation from the wanted orientation at the beginning [rad], by component.
        wanted: Which components count.
        unit: Metres for which one unit of each component counts [m].
    """
    horizon = len(velocities)
    weight = np.diag(MILLIMETRE * unit * wanted)
    travel = dt * np.cumsum(means, axis=0)
    jacobian = np.kron(travel, weight)
    residual = jacobian @ velocities.ravel() + np.tile(weight @ turned, horizon)
    return LeastSquares(
        jacobian.T @ jacobian, jacobian.T @ residual, {"orientation": float(residual @ residual)}
    )

"""What the controller wants of the next moments, as least squares in the rod's response.

    sum over the horizon of   mean node distance² to the reference            tracking
                            + speed_weight |w|² + acceleration_weight |w'|²    effort
                            + SWING² mean node velocity² off the reference's   calm, at its end
                            + (lack of clearance)²                             obstacles, cf. (13)
                            + (lack of clearance of the grippers' bodies)²     grippers
                            + (rotation from a wanted orientation)²            orientation

w is the velocity of the grips on top of the path's, in metres of the rope's own motion where that
answers to a grip by more than the grip's way. The paper's (12) takes the distance itself and
a potential; squares converge quadratically, and a hinge leaves a goal near an obstacle unbiased.
Lengths enter in millimetres, so that every term is in mm².
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry.clearance import near, with_midpoints
from lariat.geometry.obstacles import Obstacle

MILLIMETRE = 1e3
SWING = 0.5
"""Distance for which a speed at the horizon's end counts, per speed [s]: a horizon is shorter than
a swing, and without it a rope that answers late is driven further and further past its goal."""
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
    solid: tuple[Obstacle, ...] = ()
    """All that the grippers must not touch."""
    gripper_reach: float = 0.0
    """From a grip to the centre of its capsule's far cap [m]."""
    gripper_clearance: float = 0.0
    """Between a gripper's axis and everything [m]."""


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
    model: Float64[np.ndarray, "h n 3"],
    slopes: Float64[np.ndarray, "h n 3 v"],
    reference: Float64[np.ndarray, "h n 3"],
    surroundings: Surroundings,
    dt: float,
) -> LeastSquares:
    """Tracking, calm and obstacles: the terms that the rope's nodes decide.

    Args:
        nodes: Predicted [m].
        model: The rod's own, which end in the grips [m].
        slopes: Of the predicted nodes in the variables.
        reference: Where the nodes should be [m].
        dt: Of a step of the horizon [s].
    """
    horizon, count = nodes.shape[:2]
    scale = MILLIMETRE / np.sqrt(count)
    rows = [scale * slopes.reshape(3 * horizon * count, -1)]
    residuals = [scale * (nodes - reference).ravel()]
    terms = ["tracking", "calm"]
    if horizon > 1:
        calm = scale * SWING / dt
        rows.append(calm * (slopes[-1] - slopes[-2]).reshape(3 * count, -1))
        residuals.append(calm * np.diff((nodes - reference)[-2:], axis=0).ravel())
    else:
        terms.pop()
    for name, (residual, row) in (
        ("obstacles", _obstacles(nodes, slopes, surroundings)),
        ("grippers", _grippers(model, slopes, surroundings)),
    ):
        terms.append(name)
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


def _grippers(
    nodes: Float64[np.ndarray, "h n 3"],
    slopes: Float64[np.ndarray, "h n 3 v"],
    surroundings: Surroundings,
) -> tuple[np.ndarray, np.ndarray]:
    """Lack of clearance of the grippers' bodies, which go on straight from the edges they hold."""
    out = surroundings.gripper_reach / float(np.linalg.norm(nodes[0, 1] - nodes[0, 0]))
    bodies = _straight_on(nodes, out).reshape(-1, 3)
    reach = np.full(len(bodies), surroundings.gripper_clearance)
    hits = near(bodies, surroundings.solid, reach)
    felt = _straight_on(slopes, out).reshape(-1, *slopes.shape[2:])
    along = np.einsum("ac,acv->av", hits.normals, felt[hits.points])
    weight = MILLIMETRE * NEARNESS
    return weight * (reach[hits.points] - hits.distances), -weight * along


def gripper_bodies(nodes: Float64[np.ndarray, "n 3"], reach: float) -> Float64[np.ndarray, "6 3"]:
    """Points on the axes of the grippers that hold a rope [m].

    Args:
        reach: From a grip to the centre of its capsule's far cap [m].
    """
    return _straight_on(nodes[None], reach / float(np.linalg.norm(nodes[1] - nodes[0])))[0]


def _straight_on(
    values: Float64[np.ndarray, "h n 3 *v"], edges: float
) -> Float64[np.ndarray, "h 6 3 *v"]:
    """Of points on the lines of the first and of the last edge, up to so many edges outwards."""
    return np.stack(
        [
            (1.0 + share * edges) * values[:, grip] - share * edges * values[:, inner]
            for grip, inner in ((0, 1), (-1, -2))
            for share in (0.0, 0.5, 1.0)
        ],
        axis=1,
    )


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

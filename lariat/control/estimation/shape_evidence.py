"""Evidence of one observed shape about a rope's unknowns, and the size of the model's error.

A smooth rope is seen across itself: only the components of a residual that are normal to the rope
count, because a node's place along the rope follows from its length and its ends, not from an
image. What remains of a residual at the best unknowns is the error of sensor and model; the latter
is alike in neighbouring nodes: resolution, set, knots of profiles, calibration. It is taken as a
process along the rope with an exponential correlation. All errors are scaled by one factor that is
learnt from the residuals; before the first observation, one has the weight of a few nodes.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.identification.posterior import Evidence

MODEL_ERROR_CORRELATION = 0.1
"""Correlation length of the model's error, as a share of the rope [-]."""
SWING_CORRELATION = 0.5
"""Correlation length of the error of a swinging rope, as a share of the rope [-]."""


@dataclass(frozen=True)
class ShapeObservation:
    """Observed shape, relative to the model's."""

    residuals: Float64[np.ndarray, "n 3"]
    """Observed minus predicted nodes [m]."""
    jacobian: Float64[np.ndarray, "n 3 P"]
    """Derivative of the predicted nodes with respect to the unknowns."""
    deviations: Float64[np.ndarray, "n"]
    """Standard deviation of a coordinate of each node, independent in all nodes [m]."""
    used: Bool[np.ndarray, "n"]
    """Nodes that count."""
    tangents: Float64[np.ndarray, "n 3"]
    """Unit tangents of the rope."""
    model_error: float
    """Standard deviation of the model's error [m]."""
    swing: Float64[np.ndarray, "n"]
    """Standard deviation of the error of each node because the rope swings [m]."""


@dataclass(frozen=True)
class WhiteShape:
    """Observation in independent components of unit variance."""

    residuals: Float64[np.ndarray, "m"]
    """Observed minus predicted [-]."""
    jacobian: Float64[np.ndarray, "m P"]
    """Derivative of the prediction with respect to the unknowns."""

    @property
    def evidence(self) -> Evidence:
        """Evidence about the unknowns."""
        return Evidence(
            self.jacobian.T @ self.jacobian,
            self.jacobian.T @ self.residuals,
            0.5 * float(self.residuals @ self.residuals),
        )


def whiten(shape: ShapeObservation, scale: float) -> WhiteShape:
    """Return an observation in independent components.

    Args:
        shape: Observed shape.
        scale: Factor on the errors of sensor and model [-].
    """
    used = np.flatnonzero(shape.used)
    places = used / (len(shape.used) - 1)
    apart = np.abs(places[:, None] - places)
    covariance = shape.model_error**2 * np.exp(-apart / MODEL_ERROR_CORRELATION)
    covariance += np.diag(shape.deviations[used] ** 2)
    swing = np.outer(shape.swing[used], shape.swing[used]) * np.exp(-apart / SWING_CORRELATION)
    factor = np.linalg.cholesky(scale**2 * covariance + swing)
    normals = _normals(shape.tangents[used])
    residuals = np.einsum("kac,kc->ka", normals, shape.residuals[used])
    jacobian = np.einsum("kac,kcp->kap", normals, shape.jacobian[used])
    count = len(used)
    white = np.linalg.solve(
        factor, np.concatenate([residuals, jacobian.reshape(count, -1)], axis=1)
    )
    return WhiteShape(white[:, :2].ravel(), white[:, 2:].reshape(2 * count, -1))


def with_own_value(seen: Evidence, index: int, spread: float) -> Evidence:
    """Return the evidence of an observation in which one unknown has a value of its own.

    Args:
        seen: Evidence if the unknown were the same in all observations.
        index: Place of the unknown.
        spread: Standard deviation of its own value from the common one.
    """
    row = seen.information[index]
    share = spread**2 / (1.0 + spread**2 * row[index])
    descent = seen.descent - share * seen.descent[index] * row
    cost = seen.cost - 0.5 * share * seen.descent[index] ** 2
    return Evidence(seen.information - share * np.outer(row, row), descent, cost)


class ErrorScale:
    """Factor on all assumed errors, learnt from what remains of the residuals of many shapes."""

    def __init__(self, weight: float) -> None:
        """Create a factor of one.

        Args:
            weight: Number of observed components that outweigh the initial factor.
        """
        self._square_sum = self._count = weight
        self._shape_square_sum = self._shape_count = 0.0

    @property
    def factor(self) -> float:
        """Factor [-]."""
        return math.sqrt(
            (self._square_sum + self._shape_square_sum) / (self._count + self._shape_count)
        )

    def take(
        self, shape: WhiteShape, step: Float64[np.ndarray, "P"], covariance: np.ndarray
    ) -> None:
        """Take in the present shape, in place of what was taken of it before.

        Args:
            shape: Observation of a rope at rest, whitened with the present factor.
            step: Change of the unknowns since they were predicted.
            covariance: Covariance of the unknowns.
        """
        left = shape.residuals - shape.jacobian @ step
        explained = float(np.sum((shape.jacobian @ covariance) * shape.jacobian))
        self._shape_square_sum = self.factor**2 * float(left @ left)
        self._shape_count = max(len(left) - explained, 1.0)

    def keep(self) -> None:
        """Keep the present shape: the next one is another."""
        self._square_sum += self._shape_square_sum
        self._count += self._shape_count
        self._shape_square_sum = self._shape_count = 0.0


def _normals(tangents: Float64[np.ndarray, "k 3"]) -> Float64[np.ndarray, "k 2 3"]:
    """Return two unit vectors across each tangent."""
    least = np.eye(3)[np.argmin(np.abs(tangents), axis=1)]
    first = np.cross(tangents, least)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(tangents, first)], axis=1)

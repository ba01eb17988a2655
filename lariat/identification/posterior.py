"""Gaussian posterior of unknowns from robustly weighted residuals and a prior.

Errors of a rope's motion are correlated between neighbouring vertices and successive frames, and
outliers must not dominate. Both the fit of recorded motion and the adaptation during control use
these weights.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64


@dataclass(frozen=True)
class Evidence:
    """Quadratic model of a cost: cost - descent . dx + dx . information dx / 2."""

    information: Float64[np.ndarray, "P P"]
    """Gauss-Newton Hessian of the cost."""
    descent: Float64[np.ndarray, "P"]
    """Negative gradient of the cost."""
    cost: float
    """Value of the cost [-]."""

    def __add__(self, other: Evidence) -> Evidence:
        return Evidence(
            self.information + other.information,
            self.descent + other.descent,
            self.cost + other.cost,
        )


def evidence(
    residuals: Float64[np.ndarray, "m 3"],
    jacobian: Float64[np.ndarray, "m 3 P"],
    noise: float | Float64[np.ndarray, "m"],
    independent_share: float,
) -> Evidence:
    """Return the evidence of measured points under the pseudo-Huber loss.

    The loss is quadratic near zero and linear far out, which bounds the influence of outliers.

    Args:
        residuals: Measured minus predicted [m].
        jacobian: Derivative of the predicted points with respect to the unknowns.
        noise: Standard deviation of a coordinate, of all points or of each [m].
        independent_share: Share of the points that count as independent [-].
    """
    variance = np.asarray(noise, float) ** 2
    root = np.sqrt(1.0 + np.sum(residuals**2, axis=1) / (3.0 * variance))
    weight = independent_share / (variance * root)
    weighted = jacobian * weight[:, None, None]
    information = np.tensordot(jacobian, weighted, axes=([0, 1], [0, 1]))
    descent = np.tensordot(weighted, residuals, axes=([0, 1], [0, 1]))
    return Evidence(information, descent, loss(residuals, noise, independent_share))


def loss(
    residuals: Float64[np.ndarray, "m 3"],
    noise: float | Float64[np.ndarray, "m"],
    independent_share: float,
) -> float:
    """Return the pseudo-Huber loss of residuals; arguments as of `evidence`."""
    variance = np.asarray(noise, float) ** 2
    root = np.sqrt(1.0 + np.sum(residuals**2, axis=1) / (3.0 * variance))
    return float(independent_share * 3.0 * np.sum(root - 1.0))


def prior(x: Float64[np.ndarray, "P"], information: Float64[np.ndarray, "P P"]) -> Evidence:
    """Return the evidence at x of a Gaussian prior with mean zero.

    Args:
        x: Unknowns.
        information: Inverse covariance of the prior.
    """
    gradient = information @ x
    return Evidence(information, -gradient, float(0.5 * x @ gradient))


def gauss_newton_step(
    evidence: Evidence, free: Bool[np.ndarray, "P"], levenberg: float = 0.0
) -> Float64[np.ndarray, "P"]:
    """Return the Gauss-Newton step of the free unknowns.

    Args:
        evidence: All evidence, prior included.
        free: Unknowns that may change.
        levenberg: Damping relative to the diagonal of the Hessian [-].
    """
    inner = evidence.information[np.ix_(free, free)]
    inner = inner + levenberg * np.diag(np.diag(inner))
    dx = np.zeros(len(evidence.descent))
    dx[free] = np.linalg.solve(inner, evidence.descent[free])
    return dx


def covariance(
    blocks: Sequence[Evidence], prior: Float64[np.ndarray, "P P"], free: Bool[np.ndarray, "P"]
) -> Float64[np.ndarray, "P P"]:
    """Return the covariance of the unknowns at a minimum, whatever the errors' correlation is.

    Sandwich estimator: between the curvatures stands the measured scatter of the gradients of
    blocks of measurements, whose errors may be correlated within a block. Each gradient is
    corrected for what its block has itself drawn the minimum to it (CR3, Bell and McCaffrey, 2002).
    Few blocks show the scatter in few directions; with a share of P / (P + blocks), that of P
    unknowns is therefore the scatter that independent errors would have, times its mean excess over
    all directions.

    Args:
        blocks: Evidence of each block, prior excluded.
        prior: Inverse covariance of the prior.
        free: Unknowns that may change.
    """
    inside = np.ix_(free, free)
    information = sum((b.information for b in blocks), np.zeros_like(prior))[inside]
    total = information + prior[inside]
    inner = np.linalg.inv(total)
    scatter = information
    if len(blocks) > 1:
        scores = np.stack(
            [
                total @ np.linalg.solve(total - b.information[inside], b.descent[free])
                for b in blocks
            ]
        )
        scores = scores - scores.mean(axis=0)
        measured = scores.T @ scores * (len(blocks) - 1) / len(blocks)
        excess = float(np.trace(inner @ measured) / np.trace(inner @ information))
        share = len(information) / (len(information) + len(blocks))
        scatter = share * excess * information + (1.0 - share) * measured
    result = np.zeros_like(prior)
    result[inside] = inner @ (scatter + prior[inside]) @ inner
    return result

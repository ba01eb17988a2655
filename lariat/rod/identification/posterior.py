"""What data say about unknowns, next to what was believed before.

Residuals of a rope's motion err together: neighbouring vertices and following frames are not
independent, and a bad one must not pull. Both the fit of recorded motion and the adaptation while
control runs weigh them here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64


@dataclass(frozen=True)
class Evidence:
    """A quadratic around a point: cost = pulls . dx + dx . information dx / 2."""

    information: Float64[np.ndarray, "P P"]
    pull: Float64[np.ndarray, "P"]
    """Downhill."""
    cost: float

    def __add__(self, other: Evidence) -> Evidence:
        return Evidence(
            self.information + other.information, self.pull + other.pull, self.cost + other.cost
        )


def evidence(
    residuals: Float64[np.ndarray, "m 3"],
    slopes: Float64[np.ndarray, "m 3 P"],
    noise: float | Float64[np.ndarray, "m"],
    counting: float,
) -> Evidence:
    """Of points that are seen `residuals` away from where they are predicted.

    The loss is the square near zero and the distance far out (pseudo-Huber), so that a bad point
    pulls no harder than one a few noises off.

    Args:
        residuals: Measured minus predicted [m].
        slopes: Of the prediction.
        noise: Standard deviation of a coordinate [m].
        counting: Share of the points that count as independent.
    """
    scale = np.asarray(noise, float) ** 2
    miss = np.sqrt(1.0 + np.sum(residuals**2, axis=1) / (3.0 * scale))
    weight = counting / (scale * miss)
    weighted = slopes * weight[:, None, None]
    information = np.tensordot(slopes, weighted, axes=([0, 1], [0, 1]))
    pull = np.tensordot(weighted, residuals, axes=([0, 1], [0, 1]))
    return Evidence(information, pull, loss(residuals, noise, counting))


def loss(
    residuals: Float64[np.ndarray, "m 3"],
    noise: float | Float64[np.ndarray, "m"],
    counting: float,
) -> float:
    """The cost that `evidence` is the slope of."""
    scale = np.asarray(noise, float) ** 2
    miss = np.sqrt(1.0 + np.sum(residuals**2, axis=1) / (3.0 * scale))
    return float(counting * 3.0 * np.sum(miss - 1.0))


def belief(x: Float64[np.ndarray, "P"], information: Float64[np.ndarray, "P P"]) -> Evidence:
    """What was believed before, zero in all unknowns, as evidence at x."""
    away = information @ x
    return Evidence(information, -away, float(0.5 * x @ away))


def step(
    found: Evidence, free: Bool[np.ndarray, "P"], levenberg: float = 0.0
) -> Float64[np.ndarray, "P"]:
    """The Gauss-Newton step of the free unknowns; Levenberg's damping makes it shorter."""
    inner = found.information[np.ix_(free, free)]
    inner = inner + levenberg * np.diag(np.diag(inner))
    dx = np.zeros(len(found.pull))
    dx[free] = np.linalg.solve(inner, found.pull[free])
    return dx


def covariance(
    found: Evidence, clusters: list[Evidence], free: Bool[np.ndarray, "P"]
) -> Float64[np.ndarray, "P P"]:
    """Of the unknowns at a minimum; where clusters disagree it grows by how much they do.

    Args:
        found: All evidence, belief included.
        clusters: Parts of it that err independently of each other.
    """
    result = np.zeros_like(found.information)
    inner = np.linalg.inv(found.information[np.ix_(free, free)])
    if len(clusters) > 1:
        pulls = np.stack([c.pull[free] for c in clusters])
        pulls = pulls - pulls.mean(axis=0)
        spread = pulls.T @ pulls * len(clusters) / (len(clusters) - 1)
        # Sandwich: the model's own curvature with the scatter that the pulls really have.
        inner = inner + inner @ spread @ inner
    result[np.ix_(free, free)] = inner
    return result

"""Fit of an inextensible chain to rays and ranges, with standard deviations."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int32

from lariat.kernel_cache import cache
from lariat.kernel_cache.source import KernelSource
from lariat.perception.centerline.bandwidth import scratch

KERNEL = KernelSource(
    "perception-fit",
    "lariat.perception.centerline.kernels.fit:fit",
    ("lariat.perception.centerline.kernels", "lariat.perception.centerline.bandwidth"),
    "lariat.perception.centerline.fit_self_tests:self_tests",
    Path(__file__).parents[3],
)
"""Kernel of the fit."""


@dataclass(frozen=True)
class FitSettings:
    """Measurement noise, shape priors and convergence."""

    ray_sigma: float = 0.35
    """Standard deviation of a ridge point across the rope [pixels]; neighbours share pixels."""
    edge_sigma: float = 3e-5
    """Standard deviation of the length of an edge [m]."""
    free_length_sigma: float = 0.02
    """The same while the length of the rope is measured, as a share of the edge [-]."""
    curvature_sigma: float = 7.0
    """Standard deviation of the curvature of an unobserved rope [1/m]."""
    curvature_change_sigma: float = 700.0
    """Standard deviation of the derivative of curvature along the rope [1/m^2]."""
    tolerance: float = 1e-5
    """Largest step of a node below which the iteration has converged [m]."""
    max_iterations: int = 30
    """Largest number of Gauss-Newton iterations."""


@dataclass(frozen=True)
class Fit:
    """Fitted chain."""

    nodes: Float64[np.ndarray, "n 3"]
    """Node positions [m]."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each position, all directions together [m]."""
    support: Float64[np.ndarray, "n"]
    """Sum of the robust weights of the ranges around each node; outliers hardly count."""
    misfit: float
    """Root mean square of the residuals over their standard deviations [-]."""
    outliers: float
    """Share of the ranges that are outliers."""


class ChainFit:
    """Gauss-Newton fit of chains with a given number of nodes; owns the kernel's memory."""

    def __init__(
        self,
        node_count: int,
        length: float,
        weight_over_stiffness: float = 0.0,
        settings: FitSettings | None = None,
    ) -> None:
        """
        Args:
            node_count: Number of nodes n.
            length: Length of the chain [m].
            weight_over_stiffness: Weight per length over bending stiffness [1/m^3].
            settings: Noise, priors and convergence.
        """
        self._kernel = cache.kernel(KERNEL)
        self.settings = settings or FitSettings()
        self._edge = length / (node_count - 1)
        self._weight_over_stiffness = weight_over_stiffness
        self._scratch = scratch(node_count)
        self._support = np.zeros(node_count)
        self._variance = np.zeros(node_count)
        self._statistics = np.zeros(4)

    def solve(
        self,
        start: Float64[np.ndarray, "n 3"],
        samples: Float64[np.ndarray, "m 6"],
        segments: Int32[np.ndarray, "m"],
        eye: Float64[np.ndarray, "3"],
        anchors: Float64[np.ndarray, "n 4"],
        *,
        length_ratio: float = 1.0,
        free_length: bool = False,
    ) -> Fit:
        """Return the most likely chain.

        Args:
            start: Initial node positions [m].
            samples: Rays and ranges, columns as in `kernels.fit.fit`.
            segments: Segment on which each sample is assumed to lie.
            eye: Centre of projection [m].
            anchors: Expected position of each node and its standard deviation [m]; a standard
                deviation of 0 means no anchor.
            length_ratio: Length of the chain, relative to the given one [-].
            free_length: Whether all edges may stretch, so that the samples tell the length.
        """
        nodes = np.ascontiguousarray(start, dtype=np.float64).copy()
        s, edge = self.settings, length_ratio * self._edge
        self._kernel(
            nodes,
            np.ascontiguousarray(samples),
            np.ascontiguousarray(segments, dtype=np.int32).copy(),
            np.ascontiguousarray(eye, dtype=np.float64),
            np.ascontiguousarray(anchors),
            *self._scratch,
            self._support,
            self._variance,
            self._statistics,
            edge,
            s.free_length_sigma * edge if free_length else s.edge_sigma,
            s.curvature_sigma * edge**2,
            self._weight_over_stiffness / s.curvature_sigma**2,
            s.curvature_change_sigma * edge**3,
            s.tolerance,
            s.max_iterations,
        )
        cost, count, outliers, _ = self._statistics
        ranges = max(1, int(np.count_nonzero(samples[:, 3] > 0.0)))
        return Fit(
            nodes,
            np.sqrt(self._variance),
            self._support.copy(),
            float(np.sqrt(cost / max(count, 1.0))),
            float(outliers / ranges),
        )

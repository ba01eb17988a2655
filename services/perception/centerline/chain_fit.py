"""An inextensible chain fitted to rays and ranges, with what it knows about itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64, Int32

from lariat.rod.launch import taichi_runtime
from services.perception.centerline import kernels


@dataclass(frozen=True)
class FitSettings:
    """What the fit believes about sensor and rope."""

    ray_sigma: float = 0.35
    """Deviation of one ridge point across the rope [pixels]; neighbours share their pixels."""
    edge_sigma: float = 3e-5
    """Deviation of the length of an edge [m]."""
    curvature_sigma: float = 7.0
    """Deviation of the curvature of a rope that nothing is known of [1/m]."""
    change_sigma: float = 700.0
    """Deviation of the change of curvature along the rope [1/m^2]."""
    tolerance: float = 1e-5
    """The fit is done when no node moves further [m]."""
    iterations: int = 30
    """Of Gauss-Newton, at most."""


@dataclass(frozen=True)
class Fit:
    """A fitted chain."""

    nodes: Float64[np.ndarray, "n 3"]
    """[m]."""
    sigma: Float64[np.ndarray, "n"]
    """Standard deviation of each node's position, all directions together [m]."""
    support: Float64[np.ndarray, "n"]
    """How many ranges speak for each node."""
    misfit: float
    """Root mean square of the residuals over their deviations; 1 where the noise is as assumed."""
    outliers: float
    """Part of the ranges that the fit does not believe."""


class ChainFit:
    """Owns the fit's memory for one number of nodes."""

    def __init__(
        self,
        node_count: int,
        length: float,
        heaviness: float = 0.0,
        settings: FitSettings | None = None,
    ) -> None:
        """A fit of equal edges.

        Args:
            node_count: n.
            length: Of the rope [m].
            heaviness: Weight per length over bending stiffness [1/m^3]; 0 in no gravity.
            settings: What it believes.
        """
        taichi_runtime.start()
        self.settings = settings or FitSettings()
        self._edge = length / (node_count - 1)
        self._heaviness = heaviness
        self._matrix = np.zeros((3 * node_count, kernels.BAND))
        self._right = np.zeros(3 * node_count)
        self._support = np.zeros(node_count)
        self._variance = np.zeros(node_count)
        self._report = np.zeros(4)

    def solve(
        self,
        start: Float64[np.ndarray, "n 3"],
        samples: Float64[np.ndarray, "m 7"],
        segments: Int32[np.ndarray, "m"],
        eye: Float64[np.ndarray, "3"],
        anchors: Float64[np.ndarray, "n 4"],
    ) -> Fit:
        """The most likely chain.

        Args:
            start: Where to begin [m].
            samples: Columns as in `kernels.fit`.
            segments: The segment that each sample is thought to lie on.
            eye: Centre of projection [m].
            anchors: A place for each node and its deviation [m], 0 where there is none.
        """
        nodes = np.ascontiguousarray(start, dtype=np.float64).copy()
        s, edge = self.settings, self._edge
        kernels.fit(
            nodes,
            np.ascontiguousarray(samples),
            np.ascontiguousarray(segments, dtype=np.int32).copy(),
            np.ascontiguousarray(eye, dtype=np.float64),
            np.ascontiguousarray(anchors),
            self._matrix,
            self._right,
            self._support,
            self._variance,
            self._report,
            edge,
            s.edge_sigma,
            s.curvature_sigma * edge**2,
            self._heaviness / s.curvature_sigma**2,
            s.change_sigma * edge**3,
            s.tolerance,
            s.iterations,
        )
        cost, count, outliers, _ = self._report
        ranges = max(1, int(np.count_nonzero(samples[:, 3] > 0.0)))
        return Fit(
            nodes,
            np.sqrt(self._variance),
            self._support.copy(),
            float(np.sqrt(cost / max(count, 1.0))),
            float(outliers / ranges),
        )

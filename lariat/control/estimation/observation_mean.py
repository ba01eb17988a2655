"""Mean of the observed nodes while the grips stand still."""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

OUTLIER_DEVIATIONS = 4.0
"""Distance from the mean, in standard deviations, above which an observed node counts less [-]."""
MIN_OBSERVATIONS = 3
"""Observations before which none is an outlier."""
MAX_OBSERVATIONS = 30
"""Observations after which the weight of a new one falls no further."""


class ObservationMean:
    """Running mean of the nodes observed since the grips stopped; old observations fade."""

    def __init__(self) -> None:
        """Create a mean of no observations."""
        self.count = 0
        """Number of observations."""
        self._weights: np.ndarray = np.zeros(0)

    def add(
        self,
        nodes: Float64[np.ndarray, "n 3"],
        sigma: Float64[np.ndarray, "n"],
        observed: Bool[np.ndarray, "n"],
    ) -> None:
        """Add an observation.

        Args:
            nodes: Observed nodes [m].
            sigma: Standard deviation of each node's position [m].
            observed: Nodes that were seen; the others do not count.
        """
        if not self.count:
            self._weights = np.zeros(len(nodes))
            self.nodes, self._noise, self._spread = nodes, *np.zeros((2, len(nodes)))
        self.count += 1
        self._weights = np.minimum(self._weights, MAX_OBSERVATIONS - 1) + observed
        miss = nodes - self.nodes
        share = observed / np.maximum(self._weights, 1.0)
        if self.count > MIN_OBSERVATIONS:
            usual = OUTLIER_DEVIATIONS * np.sqrt(3.0 * (self._noise + self._spread))
            share = share * np.minimum(1.0, usual / np.maximum(np.linalg.norm(miss, axis=1), 1e-12))
        self.nodes = self.nodes + share[:, None] * miss
        self._noise = self._noise + share * (np.maximum(sigma, 0.0) ** 2 - self._noise)
        excess = (1.0 - share) * np.mean(miss**2, axis=1)
        self._spread = (1.0 - share) * self._spread + share * excess

    @property
    def observed(self) -> Bool[np.ndarray, "n"]:
        """Nodes that were seen at least once."""
        return self._weights > 0.0

    @property
    def variance(self) -> Float64[np.ndarray, "n"]:
        """Variance of the mean's coordinates [m^2].

        Swinging, the spread beyond the noise, is not reduced by averaging.
        """
        swinging = np.maximum(self._spread - self._noise, 0.0)
        return self._noise / np.maximum(self._weights, 1.0) + swinging

"""Node chains copied from the simulator's truth, for scenarios that sense without a camera."""

from __future__ import annotations

import numpy as np

from lariat.geometry import polylines
from shared.messages import NodeChain, chain

MIN_SIGMA = 1e-5
"""Standard deviation of exact nodes [m]; not zero, since estimators divide by it."""


class SimulatedTruth:
    """Turns true node chains into perceived ones, with noise if the scenario asks for it."""

    def __init__(self, node_count: int, noise: float, seed: int) -> None:
        """Chains of another `node_count` are resampled; `noise` is of every coordinate [m]."""
        self._node_count, self._noise = node_count, noise
        self._random = np.random.default_rng(seed)

    def perceive(self, truth: NodeChain) -> NodeChain:
        """Return the chain that perception publishes for a true one."""
        nodes = chain(truth.positions)
        if len(nodes) != self._node_count:
            nodes = polylines.resample_smooth(nodes, self._node_count)
        if self._noise:
            nodes = nodes + self._noise * self._random.normal(size=nodes.shape)
        return NodeChain(
            stamp=truth.stamp,
            positions=nodes.ravel(),
            sigma=np.full(len(nodes), max(self._noise, MIN_SIGMA)),
            observed=[True] * len(nodes),
        )

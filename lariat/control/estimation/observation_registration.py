"""Observation of a rope whose length and grips are not known exactly, laid along its model.

Perception lays a chain of the given length between the grips that the arms report, and lets its
ends lie beside them. The nodes lie on the rope, but where along it is no measurement if the length
or the grips are off.
"""

from __future__ import annotations

import math

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses

GRIP_DISTANCE = 0.035
"""Distance along the rope from a grip below which nodes do not count [m]: the believed grip
attracts them."""
GRIP_SHARE = 0.04
"""The same as a share of the rope's length [-]: a chain of a wrong length folds there."""
MAX_SLIP = 0.015
"""Largest distance along the rope by which a node is moved, as a share of the rope's length [-]."""


def registered_nodes(
    nodes: Float64[np.ndarray, "n 3"], model: Float64[np.ndarray, "n 3"], length: float
) -> Float64[np.ndarray, "n 3"]:
    """Return the points of an observed rope that are nearest to the nodes of a model [m].

    Args:
        nodes: Observed nodes [m].
        model: Nodes of the model at the same time [m].
        length: Length of the rope [m].
    """
    tangents = poses.normalized(np.gradient(nodes, axis=0))
    curvature = np.zeros_like(nodes)
    edge = length / (len(nodes) - 1)
    curvature[1:-1] = np.diff(nodes, 2, axis=0) / edge**2
    slip = np.sum(tangents * (model - nodes), axis=1)
    slip = np.clip(slip, -MAX_SLIP * length, MAX_SLIP * length)[:, None]
    return nodes + slip * tangents + 0.5 * slip**2 * curvature


def away_from_grips(observed: Bool[np.ndarray, "n"], length: float) -> Bool[np.ndarray, "n"]:
    """Return the observed nodes without those next to the grips.

    Args:
        observed: Observed nodes.
        length: Length of the rope [m].
    """
    edges = len(observed) - 1
    count = math.ceil(max(GRIP_DISTANCE / length, GRIP_SHARE) * edges)
    away = observed.copy()
    away[:count] = away[-count:] = False
    return away

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
"""Distance along the rope from a grip below which nodes do not count [m]: the image of the rope
ends there, and the believed grip attracts them."""
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
    slip = distances_along(nodes, model)
    return slid_nodes(nodes, np.clip(slip, -MAX_SLIP * length, MAX_SLIP * length))


def distances_along(
    nodes: Float64[np.ndarray, "n 3"], others: Float64[np.ndarray, "n 3"]
) -> Float64[np.ndarray, "n"]:
    """Return how far each node has to slide along its chain to be next to that of another [m].

    Args:
        nodes: Nodes of the chain [m].
        others: Nodes of the other chain [m].
    """
    return np.sum(_tangents(nodes) * (others - nodes), axis=1)


def slid_nodes(
    nodes: Float64[np.ndarray, "n 3"], slips: Float64[np.ndarray, "n"]
) -> Float64[np.ndarray, "n 3"]:
    """Return the nodes of a chain after they have slid along the curve through them [m].

    Args:
        nodes: Nodes of the chain, evenly spaced [m].
        slips: Distance by which each node slides [m].
    """
    edge = np.mean(np.linalg.norm(np.diff(nodes, axis=0), axis=1))
    curvature = np.zeros_like(nodes)
    curvature[1:-1] = np.diff(nodes, 2, axis=0) / edge**2
    along = slips[:, None]
    return nodes + along * _tangents(nodes) + 0.5 * along**2 * curvature


def _tangents(nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "n 3"]:
    return poses.normalized(np.gradient(nodes, axis=0))


def away_from_grips(observed: Bool[np.ndarray, "n"], length: float) -> Bool[np.ndarray, "n"]:
    """Return the observed nodes without those next to the grips.

    Args:
        observed: Observed nodes.
        length: Length of the rope [m].
    """
    edges = len(observed) - 1
    count = math.ceil(GRIP_DISTANCE / length * edges)
    away = observed.copy()
    away[:count] = away[-count:] = False
    return away

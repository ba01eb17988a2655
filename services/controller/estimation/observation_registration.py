"""Observation of a rope whose length and grips are not known exactly, laid along its model.

Perception lays a chain of the given length between the grips that the arms report. The nodes lie
on the rope, but where along it is no measurement if the length or the grips are off, and the nodes
next to a grip lie where it is believed to hold the rope.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import poses

GRIP_NODES = 4
"""Nodes at each end whose observed positions are those of the believed grips."""
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
    slip = np.sum(tangents * (model - nodes), axis=1)
    slip = np.clip(slip, -MAX_SLIP * length, MAX_SLIP * length)
    return nodes + slip[:, None] * tangents


def away_from_grips(observed: Bool[np.ndarray, "n"]) -> Bool[np.ndarray, "n"]:
    """Return the observed nodes without those that are taken from the believed grips."""
    away = observed.copy()
    away[:GRIP_NODES] = away[-GRIP_NODES:] = False
    return away

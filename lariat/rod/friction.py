"""Slips of a rod that touches bodies with friction, as a part of its state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import outward_normals
from lariat.rod.obstacle_table import unpack

_PLACE, _TURN = slice(1, 4), slice(4, 8)
"""Columns of a packed obstacle with its position and its orientation."""
_BODY = [0, 8, 9, 10]
"""Columns of a packed obstacle with its shape and sizes."""


@dataclass(frozen=True)
class ContactSlips:
    """Elastic slips of the samples of a rod on bodies, which hold it where it sticks."""

    slips: Float64[np.ndarray, "m e s 3"]
    """Displacement of the surface of the rod from its anchor, for each body and each of the s
    samples of each edge, world frame [m]; zero where the rod does not touch."""
    bodies: Float64[np.ndarray, "m 13"]
    """The bodies, from `lariat.geometry.pack`, at the places to which the slips belong."""


def carried_slips(
    contact: ContactSlips | None,
    positions: Float64[np.ndarray, "n 3"],
    radius: float,
    bodies: Float64[np.ndarray, "m 13"],
    sample_count: int,
) -> Float64[np.ndarray, "m e s 3"]:
    """Return the slips on bodies that may have moved since, each with its anchors.

    Slips of a body that has another shape now, or is gone, are zero.

    Args:
        contact: Slips with the bodies of before; None for a rod that nothing pulls along.
        positions: Nodes of the rod [m].
        radius: Radius of the rod [m].
        bodies: The bodies now.
        sample_count: Number of samples of an edge.
    """
    slips = np.zeros((len(bodies), len(positions) - 1, sample_count, 3))
    if contact is None or contact.slips.shape[1:] != slips.shape[1:]:
        return slips
    if np.array_equal(contact.bodies, bodies):
        return contact.slips
    places = ((np.arange(sample_count) + 0.5) / sample_count)[:, None]
    starts, ends = positions[:-1, None], positions[1:, None]
    samples = starts + places * (ends - starts)
    for k, (old, new) in enumerate(zip(contact.bodies, bodies, strict=False)):
        if np.any(old[_BODY] != new[_BODY]):
            continue
        touching = np.any(contact.slips[k] != 0.0, axis=-1)
        slips[k] = contact.slips[k]
        if np.array_equal(old, new) or not np.any(touching):
            continue
        at = samples[touching]
        surface = at - radius * outward_normals(at, unpack(old[None])[0])
        turn = poses.multiply(new[_TURN], poses.conjugate(old[_TURN]))
        anchors = surface - slips[k][touching] - old[_PLACE]
        slips[k][touching] = surface - new[_PLACE] - poses.rotate(turn, anchors)
    return slips

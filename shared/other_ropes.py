"""Ropes beside the held one as obstacles of planner and controller.

They are no part of the scene: nobody can move or remove them, and the gateway does not check them.
"""

from __future__ import annotations

import itertools

import numpy as np
from jaxtyping import Float64

from lariat.geometry.obstacles import Obstacle, capsule_between
from shared.messages import OtherRopes, chain

MAX_CHORD_ERROR = 0.0015
"""Distance of a line from the axes of its capsules, which their radius covers [m]."""


def other_rope_obstacles(message: OtherRopes) -> tuple[Obstacle, ...]:
    """Return capsules that contain the ropes; those of one rope have its name."""
    capsules = []
    for rope in message.ropes:
        radius = rope.diameter / 2.0 + MAX_CHORD_ERROR
        for line in rope.lines:
            corners = _corners(chain(line.positions))
            for a, b in itertools.pairwise(corners):
                capsules.append(capsule_between(a, b, radius, f"other rope {rope.id}"))
    return tuple(capsules)


def _corners(points: Float64[np.ndarray, "k 3"]) -> Float64[np.ndarray, "m 3"]:
    """Fewest points of a line, among them both ends, whose polygon stays close to it."""
    kept, first = [0], 0
    while first < len(points) - 1:
        last = first + 1
        while last + 1 < len(points) and _chord_error(points[first : last + 2]) < MAX_CHORD_ERROR:
            last += 1
        kept.append(last)
        first = last
    return points[kept]


def _chord_error(points: Float64[np.ndarray, "k 3"]) -> float:
    """Largest distance of a line from the chord between its ends [m]."""
    chord = points[-1] - points[0]
    square = float(chord @ chord)
    offset = points - points[0]
    if square > 0.0:
        along = np.clip(offset @ chord / square, 0.0, 1.0)
        offset = offset - along[:, None] * chord
    return float(np.max(np.linalg.norm(offset, axis=1)))

"""Threads: motions of a taut rope lengthwise through narrow passages, from one mouth to the other.

On a thread the rope lies in the middle of its passage and along it, whatever its sag is there: the
line between the grips is lifted and tilted accordingly. A thread says where the grips are, not how
the rope gets to its mouth.
"""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import scene_distance
from lariat.planning.problem import Problem
from lariat.planning.tree_search.grip_motion import Chords
from lariat.planning.tree_search.passages import Passages
from lariat.planning.tree_search.sag import SagTable

UP = np.array([0.0, 0.0, 1.0])
"""Direction against which the rope sags."""
SLOPE_SHARE = 0.02
"""Distance along the rope at which its slope is measured, relative to its length [-]."""
TAUT_SHARE = 0.96
"""Distance of the grips, relative to the longest permitted one [-]: the gateway asks that the
rope reaches round what lies between the grips."""
MOUTH_ROOM = 0.03
"""Room beyond the margin with which a passage ends [m]."""
MAX_DEPTH = 0.3
"""Largest distance of a mouth from the middle of its passage [m]."""
DEPTH_PROBES = 31
"""Number of places at which the room is compared on the way to a mouth."""


def find_threads(
    problem: Problem,
    passages: Passages,
    sag: SagTable,
    margin: float,
    step: float,
) -> Chords:
    """Return two threads for each passage, p of m places: either grip leads.

    They go from the mouth at the start's side to the one at the goal's.

    Args:
        margin: Distance that the rope's centreline keeps from obstacles [m].
        step: Longest motion from place to place [m].
    """
    # A path that was not followed is replaced by one of another kind: the gateway may have refused
    # a rope that is taut round the edges of its passage.
    if not len(passages) or not problem.moves[:, :3].all() or problem.spare_clearance > 0.0:
        return Chords(np.zeros((0, 2, 3)), np.zeros((0, 2, 3)))
    onward = problem.goal.nodes.mean(axis=0) - problem.state.positions.mean(axis=0)
    back = passages.directions @ onward < 0.0
    ways = np.where(back[:, None], -passages.directions, passages.directions)
    taut = TAUT_SHARE * problem.longest_grip_distance
    before, after = (
        0.5 * taut + _depth(problem, passages.places, sign * ways, margin) for sign in (-1.0, 1.0)
    )
    count = 1 + int(np.ceil(np.max(before + after) / step))
    share = np.linspace(0.0, 1.0, count)
    offsets = share * (before + after)[:, None] - before[:, None]
    middles, chords = [], []
    for sign in (1.0, -1.0):
        along = np.repeat(sign * ways[:, None], count, axis=1).reshape(-1, 3)
        # Place of the passage along the rope, from its left end.
        fractions = 0.5 - sign * offsets.ravel() / taut
        deeper = sag.below(taut * along, fractions + SLOPE_SHARE)
        slope = (deeper - sag.below(taut * along, fractions - SLOPE_SHARE)) / (
            2.0 * SLOPE_SHARE * taut
        )
        chord = taut * poses.normalized(along + slope[:, None] * UP)
        lift = sag.below(chord, fractions)[:, None] * UP
        place = np.repeat(passages.places[:, None], count, axis=1).reshape(-1, 3)
        middle = place + lift - (fractions - 0.5)[:, None] * chord
        middles.append(middle.reshape(-1, count, 3))
        chords.append(chord.reshape(-1, count, 3))
    # Both threads of a passage follow each other.
    order = np.argsort(np.tile(np.arange(len(passages)), 2), kind="stable")
    return Chords(np.concatenate(middles), np.concatenate(chords))[order]


def _depth(
    problem: Problem,
    places: Float64[np.ndarray, "p 3"],
    ways: Float64[np.ndarray, "p 3"],
    margin: float,
) -> Float64[np.ndarray, "p"]:
    """Distance from a place to the mouth of its passage along a way [m]."""
    at = np.linspace(0.0, MAX_DEPTH, DEPTH_PROBES)
    probes = places[:, None] + at[:, None] * ways[:, None]
    opened = scene_distance(probes, problem.solid) > margin + MOUTH_ROOM
    first = np.where(opened.any(axis=1), np.argmax(opened, axis=1), len(at) - 1)
    return at[first]

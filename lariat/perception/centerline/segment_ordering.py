"""Order and direction of the visible segments along the rope."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose

MAX_PERMUTED_SEGMENTS = 4
"""Number of segments, longest first, of which all orders are compared."""
MAX_RIVAL_ORDERS = 3
"""Largest number of orders that are fitted."""
RIVAL_COST_FACTOR, RIVAL_COST_OFFSET = 1.5, 0.03
"""Factor [-] and offset [m]: an order rivals the best one if its cost is below factor times the
best cost plus offset."""
EXCESS_LENGTH_WEIGHT = 10.0
"""Weight of the length by which an order exceeds the rope's length [-]."""
LENGTH_TOLERANCE = 1.03
"""Factor on the rope's length up to which an order does not exceed it."""
WRONG_SIDE_COST = 1e-3
"""Cost of an order whose left end has the larger x, where no grip is known [m]."""
MAX_TURNING_LENGTH = 0.05
"""Length of a gap above which the cost of turning against its chord is constant [m]."""
BENDING_LENGTH = 0.02
"""Cost of a turn by 90 degrees between both ends of a gap [m]."""
HEADING_POINTS = 12
"""Number of points over which the direction of a segment's end is taken."""
MAX_COMPARED_POINTS = 40
"""Approximate number of points of a segment that are compared with a prior."""

Points = Float64[np.ndarray, "k 3"]
"""Points along a segment, in order [m]."""
End = tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]
"""End of a segment: position [m] and unit tangent along the rope."""


@dataclass(frozen=True)
class SegmentOrder:
    """Segments from the left end of the rope to the right one."""

    indices: tuple[int, ...]
    """Indices into the segments."""
    flipped: tuple[bool, ...]
    """Whether the points of each run from right to left."""


def order_by_prior(
    prior: Float64[np.ndarray, "n 3"], segments: Sequence[Points], reach: float
) -> SegmentOrder:
    """Return the order in which an expected shape passes the segments.

    Args:
        prior: Expected nodes, left end first [m].
        segments: Points along each segment [m].
        reach: Mean distance from the prior above which a segment is left out [m].
    """
    s = polylines.arc_lengths(prior)
    dense = polylines.resample(prior, 4 * len(prior))
    at = np.linspace(0.0, s[-1], len(dense))
    passages: list[tuple[float, int, bool]] = []
    for index, points in enumerate(segments):
        sampled = points[:: max(1, len(points) // MAX_COMPARED_POINTS)]
        distances = polylines.point_distances(sampled, dense)
        nearest = np.argmin(distances, axis=1)
        if np.mean(distances[np.arange(len(sampled)), nearest]) > reach:
            continue
        along = at[nearest]
        trend = float((along - along.mean()) @ np.arange(len(along)))
        passages.append((float(np.median(along)), index, trend < 0.0))
    passages.sort()
    return SegmentOrder(tuple(i for _, i, _ in passages), tuple(f for _, _, f in passages))


def order_by_gaps(
    segments: Sequence[Points], left: Pose | None, right: Pose | None, length: float
) -> list[SegmentOrder]:
    """Return the orders that join the segments with short and straight gaps, best first.

    Args:
        segments: Points along each segment [m], longest segment first.
        left: Grip of the left end; None where it is unknown.
        right: Grip of the right end.
        length: Length of the rope [m]; longer orders are accepted only where nothing else fits.
    """
    permuted = list(range(min(len(segments), MAX_PERMUTED_SEGMENTS)))
    lengths = [polylines.length(p) for p in segments]
    ends = [segment_ends(p) for p in segments]
    orders: list[tuple[float, tuple[int, ...], tuple[bool, ...]]] = []
    for count in range(1, len(permuted) + 1):
        for indices in itertools.permutations(permuted, count):
            for flips in itertools.product((False, True), repeat=count):
                cost = _order_cost(indices, flips, ends, lengths, left, right, length)
                if left is None and right is None:
                    # Without grips, the end with the smaller x is the left one.
                    first, last = indices[0], indices[-1]
                    xs = (
                        segments[first][-1 if flips[0] else 0][0],
                        segments[last][0 if flips[-1] else -1][0],
                    )
                    cost += WRONG_SIDE_COST * (xs[0] > xs[1])
                orders.append((cost, indices, flips))
    orders.sort()
    limit = RIVAL_COST_FACTOR * orders[0][0] + RIVAL_COST_OFFSET
    rivals = [f for f in orders[:MAX_RIVAL_ORDERS] if f[0] < limit]
    return [SegmentOrder(indices, flips) for _, indices, flips in rivals]


def segment_ends(points: Points) -> tuple[End, End]:
    """Return both ends of a segment, with tangents in the direction of its points."""
    reach = min(len(points) - 1, HEADING_POINTS)
    first, last = points[reach] - points[0], points[-1] - points[-1 - reach]
    scale = (np.linalg.norm(first) + 1e-12, np.linalg.norm(last) + 1e-12)
    return (points[0], first / scale[0]), (points[-1], last / scale[1])


def grip_end(grip: Pose) -> End:
    """Return the end of the rope in a grip."""
    return grip.position, poses.rotate(grip.orientation, np.array([0.0, 0.0, 1.0]))


def _order_cost(
    indices: tuple[int, ...],
    flips: tuple[bool, ...],
    ends: Sequence[tuple[End, End]],
    lengths: Sequence[float],
    left: Pose | None,
    right: Pose | None,
    length: float,
) -> float:
    """Cost of an order [m]: its gaps and their turning, unused segments, excess length."""
    passed: list[End] = []
    if left is not None:
        passed.append(grip_end(left))
    total, cost = 0.0, 0.0
    for i, flip in zip(indices, flips, strict=True):
        (a, ta), (b, tb) = ends[i]
        start, end = ((b, -tb), (a, -ta)) if flip else ((a, ta), (b, tb))
        if passed:
            gap, turning = _gap_cost(*passed[-1], *start)
            total, cost = total + gap, cost + gap + turning
        passed.append(end)
        total += lengths[i]
    if right is not None:
        gap, turning = _gap_cost(*passed[-1], *grip_end(right))
        total, cost = total + gap, cost + gap + turning
    cost += sum(lengths) - sum(lengths[i] for i in indices)
    cost += EXCESS_LENGTH_WEIGHT * max(0.0, total - LENGTH_TOLERANCE * length)
    return cost


def _gap_cost(a: np.ndarray, ta: np.ndarray, b: np.ndarray, tb: np.ndarray) -> tuple[float, float]:
    """Length of a gap, and the cost of turning within it [m]."""
    chord = b - a
    length = float(np.linalg.norm(chord))
    direction = chord / (length + 1e-12)
    turning = 2.0 - float(ta @ direction) - float(tb @ direction)
    # The chord of a short gap has no reliable direction: its weight grows with its length.
    return length, min(length, MAX_TURNING_LENGTH) * turning + BENDING_LENGTH * (
        1.0 - float(ta @ tb)
    )

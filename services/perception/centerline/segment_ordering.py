"""Which piece of rope comes first, which way round, and what lies between them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose

MOST_PERMUTED = 4
"""Pieces whose orders are all tried; more of them are joined from the left, nearest next."""

RIVALS = 3
"""Orders that are worth a fit."""

Points = Float64[np.ndarray, "k 3"]


@dataclass(frozen=True)
class Order:
    """The pieces from the left end to the right one."""

    indices: tuple[int, ...]
    """Into the pieces."""
    flipped: tuple[bool, ...]
    """Whether each runs from right to left."""


def order_along(prior: Float64[np.ndarray, "n 3"], pieces: Sequence[Points], reach: float) -> Order:
    """The order in which an expected shape passes the pieces.

    Args:
        prior: Expected nodes, left end first [m].
        pieces: Points along each piece [m].
        reach: Pieces that are on average further from it are left out [m].
    """
    s = polylines.arc_lengths(prior)
    dense = polylines.resampled(prior, 4 * len(prior))
    at = np.linspace(0.0, s[-1], len(dense))
    found: list[tuple[float, int, bool]] = []
    for index, points in enumerate(pieces):
        some = points[:: max(1, len(points) // 40)]
        distances = np.linalg.norm(some[:, None] - dense[None], axis=2)
        nearest = np.argmin(distances, axis=1)
        if np.mean(distances[np.arange(len(some)), nearest]) > reach:
            continue
        along = at[nearest]
        trend = float((along - along.mean()) @ np.arange(len(along)))
        found.append((float(np.median(along)), index, trend < 0.0))
    found.sort()
    return Order(tuple(i for _, i, _ in found), tuple(f for _, _, f in found))


def orders_between(
    pieces: Sequence[Points], left: Pose | None, right: Pose | None, length: float
) -> list[Order]:
    """Orders that join the pieces with short and straight gaps, the best first.

    Args:
        pieces: Points along each piece [m]; longest first.
        left: Grip of the left end, where it is known.
        right: Grip of the right end.
        length: Of the rope [m]; a candidate that is longer is taken only when nothing fits.
    """
    few = list(range(min(len(pieces), MOST_PERMUTED)))
    spans = [polylines.length(p) for p in pieces]
    heads = [_heading(p) for p in pieces]
    up = np.array([0.0, 0.0, 1.0])
    found: list[tuple[float, tuple[int, ...], tuple[bool, ...]]] = []
    for count in range(1, len(few) + 1):
        for indices in itertools.permutations(few, count):
            for flips in itertools.product((False, True), repeat=count):
                stops: list[tuple[np.ndarray, np.ndarray]] = []
                if left is not None:
                    stops.append((left.position, poses.rotate(left.orientation, up)))
                total, cost = 0.0, 0.0
                for i, flip in zip(indices, flips, strict=True):
                    (a, ta), (b, tb) = heads[i]
                    start, end = ((b, -tb), (a, -ta)) if flip else ((a, ta), (b, tb))
                    if stops:
                        gap, bend = _gap(*stops[-1], *start)
                        total, cost = total + gap, cost + gap + bend
                    stops.append(end)
                    total += spans[i]
                if right is not None:
                    gap, bend = _gap(
                        *stops[-1], right.position, poses.rotate(right.orientation, up)
                    )
                    total, cost = total + gap, cost + gap + bend
                # What was seen and not used, and what is too long, must be explained away.
                cost += sum(spans) - sum(spans[i] for i in indices)
                cost += 10.0 * max(0.0, total - 1.03 * length)
                if left is None and right is None:
                    # Nobody says which end is left: the one with the smaller x.
                    first, last = indices[0], indices[-1]
                    xs = (
                        pieces[first][-1 if flips[0] else 0][0],
                        pieces[last][0 if flips[-1] else -1][0],
                    )
                    cost += 1e-3 * (xs[0] > xs[1])
                found.append((cost, indices, flips))
    found.sort()
    # A runner-up that is much dearer is no rival.
    rivals = [f for f in found[:RIVALS] if f[0] < 1.5 * found[0][0] + 0.03]
    return [Order(indices, flips) for _, indices, flips in rivals]


def _heading(points: Points) -> tuple[tuple[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]:
    reach = min(len(points) - 1, 12)
    first, last = points[reach] - points[0], points[-1] - points[-1 - reach]
    scale = (np.linalg.norm(first) + 1e-12, np.linalg.norm(last) + 1e-12)
    return (points[0], first / scale[0]), (points[-1], last / scale[1])


def _gap(a: np.ndarray, ta: np.ndarray, b: np.ndarray, tb: np.ndarray) -> tuple[float, float]:
    """Length of a gap, and a price for turning within it [m]."""
    chord = b - a
    length = float(np.linalg.norm(chord))
    direction = chord / (length + 1e-12)
    turning = 2.0 - float(ta @ direction) - float(tb @ direction)
    # A millimetre of gap has no direction worth speaking of.
    return length, min(length, 0.05) * turning + 0.02 * (1.0 - float(ta @ tb))


def joined(
    pieces: Sequence[Points], left: Pose | None, right: Pose | None, length: float
) -> tuple[Points, list[Float64[np.ndarray, "k"]]]:
    """One curve through ordered pieces, gaps bridged with the length that is missing.

    Returns:
        Points of the curve [m], and for each piece how far along it its points lie, in 0..1.
    """
    up = np.array([0.0, 0.0, 1.0])
    stops = [_heading(p) for p in pieces]
    gaps: list[tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]] = []
    if left is not None:
        gaps.append((left.position, poses.rotate(left.orientation, up), *stops[0][0]))
    gaps += [(*a[1], *b[0]) for a, b in itertools.pairwise(stops)]
    if right is not None:
        gaps.append((*stops[-1][1], right.position, poses.rotate(right.orientation, up)))
    chords = [float(np.linalg.norm(g[2] - g[0])) for g in gaps]
    seen = sum(polylines.length(p) for p in pieces)
    missing = (
        max(0.0, length - seen - sum(chords)) if left is not None and right is not None else 0.0
    )
    share = missing / max(sum(chords), 1e-9)
    bridges = [_bridge(*g, c * (1.0 + share)) for g, c in zip(gaps, chords, strict=True)]
    parts: list[Points] = []
    spots: list[slice] = []
    count = 0
    # What is not in view lies beyond free ends, evenly: nothing says beyond which.
    beyond = free_length(pieces, left, right, length)
    if left is None:
        point, along = stops[0][0]
        parts.append((point - beyond * along)[None])
        count += 1
    for k, piece in enumerate(pieces):
        if left is not None or k > 0:
            bridge = bridges[k if left is not None else k - 1]
            parts.append(bridge)
            count += len(bridge)
        parts.append(piece)
        spots.append(slice(count, count + len(piece)))
        count += len(piece)
    if right is not None:
        parts.append(bridges[-1])
    else:
        point, along = stops[-1][1]
        parts.append((point + beyond * along)[None])
    curve = np.concatenate(parts)
    s = polylines.arc_lengths(curve)
    return curve, [s[spot] / s[-1] for spot in spots]


def free_length(
    pieces: Sequence[Points], left: Pose | None, right: Pose | None, length: float
) -> float:
    """What must lie beyond each end that no grip holds, ordered pieces given [m]."""
    free = (left is None) + (right is None)
    if free == 0:
        return 0.0
    stops = [p[0] for p in pieces] + [pieces[-1][-1]]
    gaps = sum(float(np.linalg.norm(b[0] - a[-1])) for a, b in itertools.pairwise(pieces))
    if left is not None:
        gaps += float(np.linalg.norm(stops[0] - left.position))
    if right is not None:
        gaps += float(np.linalg.norm(stops[-1] - right.position))
    return max(0.0, length - gaps - sum(polylines.length(p) for p in pieces)) / free


def _bridge(a: np.ndarray, ta: np.ndarray, b: np.ndarray, tb: np.ndarray, length: float) -> Points:
    """A cubic from a to b along both tangents, with a given length where that is possible."""
    t = np.linspace(0.0, 1.0, 22)[1:-1, None]
    value, rise, fall = t * t * (3.0 - 2.0 * t), t * (t - 1.0) ** 2, t * t * (t - 1.0)

    def curve(pull: float) -> Points:
        return a + value * (b - a) + pull * length * (rise * ta + fall * tb)

    low, high = 0.0, 4.0
    for _ in range(12):
        middle = (low + high) / 2.0
        short = polylines.length(np.concatenate([[a], curve(middle), [b]])) < length
        low, high = (middle, high) if short else (low, middle)
    return curve(low)

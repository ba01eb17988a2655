"""Join of ordered segments into one curve, with bridges over the gaps between them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.perception.centerline.segment_ordering import End, Points, grip_end, segment_ends

BRIDGE_POINTS = 20
"""Number of points of a bridge."""
MAX_TANGENT_SCALE = 4.0
"""Largest length of a bridge's end tangents, relative to the length of the bridge."""
LENGTH_DIGITS, DIGIT_COUNT = 16, 3
"""Base and number of the digits to which the scale of a bridge's end tangents is found, relative to
the largest one."""


def join_segments(
    segments: Sequence[Points], left: Pose | None, right: Pose | None, length: float
) -> tuple[Points, list[Float64[np.ndarray, "k"]]]:
    """Join ordered segments into one curve; the bridges share the length that is missing.

    Args:
        segments: Points along each segment, from left to right [m].
        left: Grip of the left end; None where it is unknown.
        right: Grip of the right end.
        length: Length of the rope [m].

    Returns:
        Points of the curve [m], and for each segment the position of its points along it, in 0..1.
    """
    ends = [segment_ends(p) for p in segments]
    gaps: list[tuple[End, End]] = []
    if left is not None:
        gaps.append((grip_end(left), ends[0][0]))
    gaps += [(a[1], b[0]) for a, b in itertools.pairwise(ends)]
    if right is not None:
        gaps.append((ends[-1][1], grip_end(right)))
    chords = [float(np.linalg.norm(b[0] - a[0])) for a, b in gaps]
    visible = sum(polylines.length(p) for p in segments)
    missing = (
        max(0.0, length - visible - sum(chords)) if left is not None and right is not None else 0.0
    )
    share = missing / max(sum(chords), 1e-9)
    bridges = [_bridge(*a, *b, c * (1.0 + share)) for (a, b), c in zip(gaps, chords, strict=True)]
    parts: list[Points] = []
    spans: list[slice] = []
    count = 0
    # The hidden length lies beyond the free ends, in equal parts.
    beyond = hidden_end_length(segments, left, right, length)
    if left is None:
        point, tangent = ends[0][0]
        parts.append((point - beyond * tangent)[None])
        count += 1
    for k, segment in enumerate(segments):
        if left is not None or k > 0:
            bridge = bridges[k if left is not None else k - 1]
            parts.append(bridge)
            count += len(bridge)
        parts.append(segment)
        spans.append(slice(count, count + len(segment)))
        count += len(segment)
    if right is not None:
        parts.append(bridges[-1])
    else:
        point, tangent = ends[-1][1]
        parts.append((point + beyond * tangent)[None])
    curve = np.concatenate(parts)
    s = polylines.arc_lengths(curve)
    return curve, [s[span] / s[-1] for span in spans]


def hidden_end_length(
    segments: Sequence[Points], left: Pose | None, right: Pose | None, length: float
) -> float:
    """Return the length of rope beyond each end that no grip holds [m].

    Arguments as in `join_segments`.
    """
    free = (left is None) + (right is None)
    if free == 0:
        return 0.0
    ends = [p[0] for p in segments] + [segments[-1][-1]]
    gaps = sum(float(np.linalg.norm(b[0] - a[-1])) for a, b in itertools.pairwise(segments))
    if left is not None:
        gaps += float(np.linalg.norm(ends[0] - left.position))
    if right is not None:
        gaps += float(np.linalg.norm(ends[-1] - right.position))
    return max(0.0, length - gaps - sum(polylines.length(p) for p in segments)) / free


def _bridge(a: np.ndarray, ta: np.ndarray, b: np.ndarray, tb: np.ndarray, length: float) -> Points:
    """Inner points of a cubic Hermite curve from a to b, of a given length if possible [m]."""
    t = np.linspace(0.0, 1.0, BRIDGE_POINTS + 2)[:, None]
    value, rise, fall = t * t * (3.0 - 2.0 * t), t * (t - 1.0) ** 2, t * t * (t - 1.0)
    straight, bent = a + value * (b - a), length * (rise * ta + fall * tb)
    chords, turns = np.diff(straight, axis=0), np.diff(bent, axis=0)
    # Squared length of each edge, as a polynomial of the scale of the tangents.
    constant, linear, square = (
        np.vecdot(chords, chords),
        2.0 * np.vecdot(chords, turns),
        np.vecdot(turns, turns),
    )
    scale, step = 0.0, MAX_TANGENT_SCALE
    for _ in range(DIGIT_COUNT):
        step /= LENGTH_DIGITS
        tried = (scale + step * np.arange(1, LENGTH_DIGITS))[:, None]
        squares = constant + tried * (linear + tried * square)
        lengths = np.sqrt(np.maximum(squares, 0.0)).sum(axis=1)
        # The largest one that is too short.
        scale += step * int(np.count_nonzero(lengths < length))
    return (straight + scale * bent)[1:-1]

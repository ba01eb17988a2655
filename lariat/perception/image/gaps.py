"""Gaps of a rope: where something covers it, and where it leaves the image for a short way."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64, UInt8

from lariat.perception.lines.fragments import EndPose, FragmentEnd
from lariat.perception.lines.pairing import FREE_END_COST, EndCost

MAX_GAP_WIDTHS = 5.0
"""Length of background up to which a gap in a rope is bridged [rope widths]."""
MAX_GROUND_WIDTHS = 1.5
"""Length up to which a gap is bridged that surely shows no rope [rope widths]."""
GAP_COST_PER_WIDTH = 0.12
"""Cost of a bridged gap for each rope width of background in it [-]."""
MAX_GAP_SEARCH_WIDTHS = 12.0
"""Distance up to which the ends of a gap are compared [rope widths]."""
MAX_EXCURSION_WIDTHS = 1.5
"""Distance from the image up to which a rope is followed outside [rope widths]."""
MAX_EXCURSION_COST = 0.9
"""Cost of a pair up to which it is joined outside the image [-]: a loop whose turn is cut off bends
more than a rope that something covers."""
BORDER_WIDTHS = 1.5
"""Distance from the image's border up to which a rope may leave the image [rope widths]."""


def gap_pairs(
    tips: dict[FragmentEnd, Float64[np.ndarray, "2"]],
    poses: dict[FragmentEnd, EndPose],
    cost: EndCost,
    mask: UInt8[np.ndarray, "h w"],
    ground: UInt8[np.ndarray, "h w"],
    width: float,
) -> list[tuple[FragmentEnd, FragmentEnd]]:
    """Return pairs of ends across gaps of a rope, the best ones first.

    Args:
        tips: Last points of the ends that have no partner.
        poses: Places and directions of these ends, at least.
        cost: Cost of a pair.
        mask: 1 at rope pixels.
        ground: 1 where surely no rope is seen.
        width: Width of the ropes [pixels].
    """
    ends = list(tips)
    places = np.array([poses[e].position for e in ends]).reshape(-1, 2)
    ranked = []
    for k, a in enumerate(ends):
        near = np.linalg.norm(places[k + 1 :] - places[k], axis=1) < MAX_GAP_SEARCH_WIDTHS * width
        at_border = _at_border(tips[a], mask.shape, width)
        for b, close in zip(ends[k + 1 :], near.tolist(), strict=True):
            if a[0] == b[0] or not (close or at_border):
                continue
            limit, total = FREE_END_COST, cost(a, b)
            if _outside(tips[a], poses[a], tips[b], poses[b], mask.shape, width):
                limit = MAX_EXCURSION_COST
            else:
                total += _gap_cost(poses[a], poses[b], mask, ground, width)
            if total < limit:
                ranked.append((total, a, b))
    taken: set[FragmentEnd] = set()
    pairs = []
    for _, a, b in sorted(ranked):
        if a not in taken and b not in taken:
            taken |= {a, b}
            pairs.append((a, b))
    return pairs


def bridging_cubic(
    start: Float64[np.ndarray, "2"],
    leaving: EndPose,
    stop: Float64[np.ndarray, "2"],
    entering: EndPose,
) -> Float64[np.ndarray, "k 2"]:
    """Return the cubic from the last point of a fragment to the first one of the next.

    Its points are a pixel apart; start and stop are not among them.

    Args:
        start: Last point of the fragment that is left.
        leaving: Its end.
        stop: First point of the fragment that is entered.
        entering: Its end.
    """
    length = float(np.linalg.norm(stop - start))
    t = np.linspace(0.0, 1.0, max(2, int(np.ceil(length)) + 1))[1:-1, None]
    first, last = length * leaving.outward, -length * entering.outward
    return (
        (2.0 * t**3 - 3.0 * t**2 + 1.0) * start
        + (t**3 - 2.0 * t**2 + t) * first
        + (3.0 * t**2 - 2.0 * t**3) * stop
        + (t**3 - t**2) * last
    )


def _gap_cost(
    a: EndPose,
    b: EndPose,
    mask: UInt8[np.ndarray, "h w"],
    ground: UInt8[np.ndarray, "h w"],
    width: float,
) -> float:
    """Cost of the background between two ends; infinite where that is too long."""
    gap = b.position - a.position
    distance = float(np.linalg.norm(gap))
    if distance > MAX_GAP_SEARCH_WIDTHS * width:
        return np.inf
    steps = np.linspace(0.0, 1.0, max(2, round(distance)))[:, None]
    columns, rows = np.rint(a.position + steps * gap).astype(int).T
    columns, rows = np.clip(columns, 0, mask.shape[1] - 1), np.clip(rows, 0, mask.shape[0] - 1)
    background = np.count_nonzero(mask[rows, columns] == 0) / width
    surely = np.count_nonzero(ground[rows, columns]) / width
    if background > MAX_GAP_WIDTHS or surely > MAX_GROUND_WIDTHS:
        return np.inf
    return GAP_COST_PER_WIDTH * background


def _outside(
    start: Float64[np.ndarray, "2"],
    leaving: EndPose,
    stop: Float64[np.ndarray, "2"],
    entering: EndPose,
    shape: tuple[int, ...],
    width: float,
) -> bool:
    """Whether the way from one end to another leads a little way outside the image."""
    if not (_at_border(start, shape, width) and _at_border(stop, shape, width)):
        return False
    high = np.array([shape[1], shape[0]]) - 1.0
    way = bridging_cubic(start, leaving, stop, entering)
    if len(way) < 2.0 * width:
        return False
    excursion = np.maximum(-way, way - high).max(axis=1)
    # The skeleton ends up to half a width before the border.
    beyond = np.mean(excursion > -BORDER_WIDTHS * width) > 0.99 and np.max(excursion) > 0.0
    return bool(beyond and np.max(excursion) < MAX_EXCURSION_WIDTHS * width)


def _at_border(point: Float64[np.ndarray, "2"], shape: tuple[int, ...], width: float) -> bool:
    high = np.array([shape[1], shape[0]]) - 1.0
    return bool(np.min([point, high - point]) <= BORDER_WIDTHS * width)

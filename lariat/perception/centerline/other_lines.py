"""Lines of other ropes, joined across the held rope and other gaps by the least bending."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.perception.centerline.estimate import OtherLine
from lariat.perception.centerline.foreign_strands import BesideStrand
from lariat.perception.lines.fragments import EndPose, FragmentEnd
from lariat.perception.lines.pairing import FREE_END_COST, bending, cheapest_pairing

MAX_GAP_WIDTHS = 10.0
"""Length of a gap up to which it is bridged [rope widths]."""
MAX_STEP = 0.06
"""Distance in space up to which a gap is bridged [m]."""
DIRECTION_WIDTHS = 3.0
"""Length over which the direction of an end is taken [rope widths]."""
BRIDGE_POINTS = 12
"""Number of points of a bridge."""


def join_strands(strands: Sequence[BesideStrand], width: float) -> list[OtherLine]:
    """Return the lines that strands belong to, longest first.

    Args:
        strands: Strands of other ropes.
        width: Width of the ropes [pixels].
    """
    poses = {
        (k, side): _end_pose(s.pixels if side == 0 else s.pixels[::-1], width)
        for k, s in enumerate(strands)
        for side in (0, 1)
    }

    def cost(one: FragmentEnd, two: FragmentEnd) -> float:
        gap = np.linalg.norm(poses[one].position - poses[two].position)
        step = np.linalg.norm(_end_point(strands, one) - _end_point(strands, two))
        if one[0] == two[0] or gap > MAX_GAP_WIDTHS * width or step > MAX_STEP:
            return 2.0 * FREE_END_COST
        return bending(poses[one], poses[two], width)

    _, _, pairs = cheapest_pairing(poses, cost)
    partner = dict(pairs) | {b: a for a, b in pairs}
    lines, used = [], set()
    starts = [end for end in poses if end not in partner] + [(k, 0) for k in range(len(strands))]
    for start in starts:
        if start[0] not in used:
            lines.append(_follow(start, strands, partner, used))
    return sorted(lines, key=lambda line: -len(line.pixels))


def _follow(
    start: FragmentEnd,
    strands: Sequence[BesideStrand],
    partner: dict[FragmentEnd, FragmentEnd],
    used: set[int],
) -> OtherLine:
    """Line from an end through all partners; a ring is opened there."""
    pixels: list[np.ndarray] = []
    points: list[np.ndarray] = []
    end = start
    while end is not None and end[0] not in used:
        k, side = end
        used.add(k)
        flip = slice(None, None, -1 if side else 1)
        if pixels:
            pixels.append(_bridge(pixels[-1], strands[k].pixels[flip]))
            points.append(_bridge(points[-1], strands[k].points[flip]))
        pixels.append(strands[k].pixels[flip])
        points.append(strands[k].points[flip])
        end = partner.get((k, 1 - side))
    return OtherLine(np.concatenate(pixels), np.concatenate(points))


def _end_pose(pixels: Float64[np.ndarray, "k 2"], width: float) -> EndPose:
    reach = min(len(pixels) - 1, round(DIRECTION_WIDTHS * width))
    outward = pixels[0] - pixels[reach]
    return EndPose(pixels[0], outward / max(float(np.linalg.norm(outward)), 1e-9))


def _end_point(strands: Sequence[BesideStrand], end: FragmentEnd) -> Float64[np.ndarray, "3"]:
    return strands[end[0]].points[-1 if end[1] else 0]


def _bridge(
    before: Float64[np.ndarray, "k d"], after: Float64[np.ndarray, "m d"]
) -> Float64[np.ndarray, "p d"]:
    """Cubic from the end of one piece to the begin of the next, along their tangents."""
    a, b = before[-1], after[0]
    gap = float(np.linalg.norm(b - a))
    leave = a - before[-min(len(before), BRIDGE_POINTS)]
    enter = after[min(len(after), BRIDGE_POINTS) - 1] - b
    leave, enter = (gap * v / max(float(np.linalg.norm(v)), 1e-12) for v in (leave, enter))
    t = np.linspace(0.0, 1.0, BRIDGE_POINTS + 2)[1:-1, None]
    value, rise, fall = t * t * (3.0 - 2.0 * t), t * (1.0 - t) ** 2, t * t * (t - 1.0)
    return a + value * (b - a) + rise * leave + fall * enter

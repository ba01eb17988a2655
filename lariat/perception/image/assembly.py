"""Assembly of fragments into ropes, each with one ordered axis."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from jaxtyping import Bool, Float64, UInt8

from lariat.geometry import polylines
from lariat.perception.image.gaps import bridging_cubic, gap_pairs
from lariat.perception.lines.fragments import EndPose, Fragment, FragmentEnd, end_pose
from lariat.perception.lines.pairing import EndCost, bending, cheapest_pairing, color_cost

SHARED_COST = 0.1
"""Cost of a fragment that two ropes share, because they lie on each other [-]."""
MAX_THIN_SHARED_WIDTHS = 3.0
"""Length up to which two ropes may share a fragment that is no wider than one [rope widths]."""
SHARED_RADIUS_RATIO = 1.2
"""Radius from which two ropes may share a fragment of any length, relative to that of the others
that meet it, or of most of the ropes [-]."""
MAX_SHARING_ENDS = 10
"""Number of ends up to which it is asked whether two crossings share a fragment."""


@dataclass(frozen=True)
class AssembledRope:
    """Rope made of fragments."""

    points: Float64[np.ndarray, "k 2"]
    """Columns and rows of its axis, in order [pixels]."""
    clear: Bool[np.ndarray, "k"]
    """Whether the axis is seen there; False on the bridges between fragments."""
    margin: float
    """Least difference between the costs of the chosen and of the next pairing at a crossing of it
    [-]; infinite without crossings."""
    loose_end_count: int
    """Number of its ends that lie at a crossing and found no partner."""


def assemble(
    fragments: list[Fragment],
    mask: UInt8[np.ndarray, "h w"],
    ground: UInt8[np.ndarray, "h w"],
    width: float,
) -> list[AssembledRope]:
    """Return the ropes that fragments belong to, longest first.

    Args:
        fragments: Fragments of the mask's skeleton.
        mask: 1 at rope pixels.
        ground: 1 where surely no rope is seen.
        width: Width of the ropes [pixels].
    """
    if not fragments:
        return []
    poses = {
        (k, side): end_pose(f, side, width) for k, f in enumerate(fragments) for side in (0, 1)
    }

    @cache
    def cost(a: FragmentEnd, b: FragmentEnd) -> float:
        if a[0] == b[0]:
            return np.inf
        colors = color_cost(fragments[a[0]], fragments[b[0]])
        return bending(poses[a], poses[b], width) + colors

    crossings, shared = _crossings(fragments, cost, width)
    pairs: list[tuple[FragmentEnd, FragmentEnd]] = []
    margins: dict[FragmentEnd, float] = {}
    for ends in crossings:
        best, second, chosen = cheapest_pairing(ends, cost)
        pairs += chosen
        margins |= {end: second - best for end in ends if len(ends) > 2}
    taken = {e for pair in pairs for e in pair}
    open_ends = [e for e in poses if e not in taken and e[0] not in shared]
    tips = {(k, side): fragments[k].points[-side] for k, side in open_ends}
    pairs += gap_pairs(tips, poses, cost, mask, ground, width)
    partner = {a: b for pair in pairs for a, b in (pair, pair[::-1])}
    ropes = []
    for chain, points, clear in _chain(fragments, partner, shared, poses):
        outer = (chain[0], (chain[-1][0], 1 - chain[-1][1]))
        every = [(k, s) for k, _ in chain for s in (0, 1)]
        ropes.append(
            AssembledRope(
                points,
                clear,
                min((margins[e] for e in every if e in margins), default=np.inf),
                sum(e in margins and e not in partner for e in outer),
            )
        )
    return sorted(ropes, key=lambda r: -polylines.length(r.points))


def _crossings(
    fragments: list[Fragment], cost: EndCost, width: float
) -> tuple[list[list[FragmentEnd]], set[int]]:
    """Ends that meet at each crossing, and the fragments that two ropes share."""
    meeting: dict[int, list[FragmentEnd]] = {}
    for k, fragment in enumerate(fragments):
        for side, junction in enumerate(fragment.junctions):
            if junction >= 0:
                meeting.setdefault(junction, []).append((k, side))
    price = {j: cheapest_pairing(ends, cost)[0] for j, ends in meeting.items()}
    place = {j: j for j in meeting}
    shared: set[int] = set()
    gains: dict[int, tuple[float, tuple[int, int]]] = {}
    while True:
        for k, fragment in enumerate(fragments):
            if k in shared or k in gains or min(fragment.junctions) < 0:
                continue
            a, b = (place[j] for j in fragment.junctions)
            odd = len(meeting[a]) % 2 or len(meeting[b]) % 2
            if a == b or not odd or len(meeting[a]) + len(meeting[b]) > MAX_SHARING_ENDS:
                continue
            rest = [e for e in meeting[a] + meeting[b] if e[0] != k]
            if _may_be_shared(fragment, [fragments[e[0]] for e in rest], width):
                without = cheapest_pairing(rest, cost)[0] + SHARED_COST
                gains[k] = price[a] + price[b] - without, (a, b)
        k = max(gains, key=lambda k: gains[k][0], default=-1)
        if k < 0 or gains[k][0] <= 0.0:
            return list(meeting.values()), shared
        a, b = gains[k][1]
        shared.add(k)
        meeting[a] = [e for e in meeting[a] + meeting.pop(b) if e[0] != k]
        price[a] = cheapest_pairing(meeting[a], cost)[0]
        place = {j: a if at == b else at for j, at in place.items()}
        gains = {k: g for k, g in gains.items() if not {a, b} & set(g[1])}


def _may_be_shared(fragment: Fragment, beside: list[Fragment], width: float) -> bool:
    if len(fragment.points) < MAX_THIN_SHARED_WIDTHS * width:
        return True
    usual = float(np.median([f.radius for f in beside])) if beside else np.inf
    return fragment.radius > SHARED_RADIUS_RATIO * max(usual, 0.5 * width)


def _chain(
    fragments: list[Fragment],
    partner: dict[FragmentEnd, FragmentEnd],
    shared: set[int],
    poses: dict[FragmentEnd, EndPose],
) -> Iterator[tuple[list[FragmentEnd], Float64[np.ndarray, "k 2"], Bool[np.ndarray, "k"]]]:
    """Ends by which each rope's fragments are entered, its axis, and where that is seen.

    Ropes are followed from open ends; rings are opened anywhere.
    """
    used = set(shared)
    whole = range(len(fragments))
    starts = [(k, s) for k in whole for s in (0, 1) if (k, s) not in partner]
    starts += [(k, 0) for k in whole]
    for start in starts:
        if start[0] in used:
            continue
        points: list[np.ndarray] = []
        clear: list[np.ndarray] = []
        entered: list[FragmentEnd] = []
        at: FragmentEnd | None = start
        before: FragmentEnd | None = None
        while at is not None and at[0] not in used:
            k, side = at
            used.add(k)
            entered.append(at)
            ahead = fragments[k].points if side == 0 else fragments[k].points[::-1]
            if before is not None:
                bridge = bridging_cubic(points[-1][-1], poses[before], ahead[0], poses[at])
                points.append(bridge)
                clear.append(np.zeros(len(bridge), bool))
            points.append(ahead)
            clear.append(np.ones(len(ahead), bool))
            before = (k, 1 - side)
            at = partner.get(before)
        yield entered, np.concatenate(points), np.concatenate(clear)

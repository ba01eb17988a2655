"""Skeleton of a mask, traced into strands.

Where strands cross, the skeleton has junctions; at each, the branches are paired so that they
continue as straight as possible. Spurs at thick places are removed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, Int64, UInt8
from skimage.morphology import skeletonize

NEIGHBOUR_OFFSETS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
"""Row and column offsets of a pixel's eight neighbours."""
STAIRCASES = [(0, 1, 3), (2, 1, 4), (5, 3, 6), (7, 4, 6)]
"""Number of each diagonal offset, and those of the two straight ones beside it."""

MIN_STRAND_PIXELS = 5
"""Length below which a strand is dropped, since it has no direction [pixels]."""
MAX_SPUR_WIDTHS = 1.2
"""Length up to which a branch with a free end is a spur [rope widths]."""
MAX_BRIDGE_WIDTHS = 2.0
"""Length below which a branch between two junctions belongs to one crossing [rope widths]."""
DIRECTION_WIDTHS = 2.5
"""Length over which the direction of a branch at a junction is taken [rope widths]."""
MAX_PAIR_COSINE = 0.5
"""Cosine between the outward directions of two branches above which they are not joined: the strand
would turn by more than 120 degrees."""

Pixel = tuple[int, int]
"""Row and column."""
BranchEnd = tuple[int, int]
"""Index of a branch, and 0 for its first or 1 for its last pixel."""


@dataclass(frozen=True)
class Strand:
    """Visible piece of rope in the image."""

    pixels: Float64[np.ndarray, "k 2"]
    """Column and row of the skeleton's pixels, in order."""
    clear: Bool[np.ndarray, "k"]
    """False near crossings, where the skeleton is not the centreline."""


@dataclass
class Branch:
    """Skeleton pixels between two ends."""

    pixels: list[Pixel]
    """Rows and columns, in order."""
    ends: tuple[int, int]
    """Number of the junction at its first and at its last pixel; -1 where it is free."""


def trace_strands(mask: UInt8[np.ndarray, "h w"], width: float) -> list[Strand]:
    """Return the strands of a mask, longest first.

    Args:
        mask: 1 at rope pixels.
        width: Width of the rope [pixels].
    """
    branches = trace_branches(skeletonize(mask.view(bool)))
    branches = _remove_spurs(branches, MAX_SPUR_WIDTHS * width)
    chains = _pair_branches(branches, width)
    strands = [_strand(chain, width) for chain in chains]
    long = [s for s in strands if len(s.pixels) >= MIN_STRAND_PIXELS]
    return sorted(long, key=lambda s: -len(s.pixels))


def trace_branches(skeleton: Bool[np.ndarray, "h w"]) -> list[Branch]:
    """Return the branches of a skeleton, cut at its junctions.

    Args:
        skeleton: Whether a pixel belongs to the skeleton.
    """
    at, width, near = _neighbours(skeleton)
    crossing = {p for p, beside in enumerate(near) if len(beside) > 2}
    junction = _clusters(crossing, at, width)
    branches: list[tuple[list[int], tuple[int, int]]] = []
    used: set[int] = set()

    def follow(start: int, first: int) -> tuple[list[int], tuple[int, int]]:
        path, end = [start], -1
        used.add(start)
        before, here = first, start
        while True:
            beside = near[here]
            if len(beside) == 2 and before in beside:
                q = beside[beside[0] == before]
                if q not in crossing and q not in used:
                    # Nothing but a path: most pixels.
                    before, here = here, q
                    used.add(q)
                    path.append(q)
                    continue
            onward = [q for q in beside if q != before and (q in crossing or q not in used)]
            stops = [q for q in onward if q in crossing]
            if stops and not (len(path) == 1 and before in crossing and len(onward) > 1):
                end = junction[stops[0]]
                break
            onward = [q for q in onward if q not in crossing]
            if not onward:
                break
            before, here = here, onward[0]
            used.add(here)
            path.append(here)
        return path, (-1 if first < 0 else junction[first], end)

    for p in sorted(crossing):
        for q in near[p]:
            if q not in crossing and q not in used:
                branches.append(follow(q, p))
    free = [p for p in range(len(near)) if p not in used and p not in crossing]
    # What no end leads to forms closed rings.
    for p in [*(p for p in free if len(near[p]) <= 1), *free]:
        if p not in used:
            branches.append(follow(p, -1))
    rows, columns = at // width - 1, at % width - 1
    places = [*zip(rows.tolist(), columns.tolist(), strict=True)]
    return [Branch([places[p] for p in path], ends) for path, ends in branches]


def _neighbours(
    skeleton: Bool[np.ndarray, "h w"],
) -> tuple[Int64[np.ndarray, "k"], int, list[list[int]]]:
    """Return the skeleton's pixels, the width of the image, and the pixels next to each.

    Pixels stand in the order of rows, then columns, and are named by their numbers in it. Their
    places are those in a flat image with a margin of one pixel.
    """
    padded = np.pad(skeleton, 1)
    width, flat = padded.shape[1], padded.ravel()
    at = np.flatnonzero(flat)
    steps = np.array([r * width + c for r, c in NEIGHBOUR_OFFSETS])
    near = flat[at[:, None] + steps]
    # A diagonal neighbour beside a straight one is the corner of a staircase, not a branch.
    for diagonal, one, two in STAIRCASES:
        near[:, diagonal] &= ~(near[:, one] | near[:, two])
    pixel, offset = np.nonzero(near)
    positions = np.searchsorted(at, at[pixel] + steps[offset]).tolist()
    ends = np.cumsum(np.count_nonzero(near, axis=1)).tolist()
    return at, width, [positions[a:b] for a, b in zip([0, *ends[:-1]], ends, strict=True)]


def _clusters(crossing: set[int], at: Int64[np.ndarray, "k"], width: int) -> dict[int, int]:
    """Number of each junction pixel; pixels that touch share a number."""
    waiting = {int(at[p]): p for p in sorted(crossing)}
    steps = [r * width + c for r, c in NEIGHBOUR_OFFSETS]
    number: dict[int, int] = {}
    for count, seed in enumerate([*waiting]):
        stack = [seed] if seed in waiting else []
        while stack:
            place = stack.pop()
            pixel = waiting.pop(place, None)
            if pixel is not None:
                number[pixel] = count
                stack += [place + step for step in steps if place + step in waiting]
    return number


def _remove_spurs(branches: list[Branch], longest: float) -> list[Branch]:
    """Branches without the short ones that have one free end, unless a junction needs them."""
    kept = [
        b for b in branches if len(b.pixels) > longest or (min(b.ends) == -1) == (max(b.ends) == -1)
    ]
    degree: dict[int, int] = {}
    for b in kept:
        for end in b.ends:
            degree[end] = degree.get(end, 0) + 1
    # A junction with fewer than two branches left keeps its spurs: they are the ends of the strand.
    lonely = {k for k, v in degree.items() if k >= 0 and v < 2}
    kept += [b for b in branches if b not in kept and (set(b.ends) & lonely)]
    return kept


def _pair_branches(branches: list[Branch], width: float) -> list[list[Branch]]:
    """Chains of branches, joined across junctions as straight as possible."""
    # Two junctions with a short branch between them are one crossing.
    alias: dict[int, int] = {}

    def root(k: int) -> int:
        while k in alias:
            k = alias[k]
        return k

    solid: list[Branch] = []
    for b in branches:
        if min(b.ends) >= 0 and len(b.pixels) < MAX_BRIDGE_WIDTHS * width:
            if root(b.ends[0]) != root(b.ends[1]):
                alias[root(b.ends[0])] = root(b.ends[1])
        else:
            solid.append(b)
    meeting: dict[int, list[BranchEnd]] = {}
    for k, b in enumerate(solid):
        for side, end in enumerate(b.ends):
            if end >= 0:
                meeting.setdefault(root(end), []).append((k, side))
    partner: dict[BranchEnd, BranchEnd] = {}
    for meeting_ends in meeting.values():
        for a, b in _straightest_pairs(meeting_ends, solid, width):
            partner[a], partner[b] = b, a
        if len(meeting_ends) < 3:
            # Without a third branch, this is not a crossing.
            for k, side in meeting_ends:
                first, last = solid[k].ends
                solid[k].ends = (-1, last) if side == 0 else (first, -1)
    return _chain_branches(solid, partner)


def _straightest_pairs(
    meeting_ends: list[BranchEnd], branches: list[Branch], width: float
) -> list[tuple[BranchEnd, BranchEnd]]:
    """Pairs of branch ends with the least turning, chosen greedily."""
    reach = max(3, round(DIRECTION_WIDTHS * width))

    def outward_direction(branch_end: BranchEnd) -> np.ndarray:
        pixels = branches[branch_end[0]].pixels
        path = pixels if branch_end[1] == 0 else pixels[::-1]
        near, far = np.array(path[min(1, len(path) - 1)]), np.array(path[min(reach, len(path) - 1)])
        return (far - near) / max(float(np.linalg.norm(far - near)), 1e-9)

    directions = {end: outward_direction(end) for end in meeting_ends}
    ranked = sorted(
        (float(directions[a] @ directions[b]), a, b)
        for a, b in itertools.combinations(meeting_ends, 2)
        if a[0] != b[0]
    )
    taken: set[BranchEnd] = set()
    pairs = []
    for cosine, a, b in ranked:
        if cosine < MAX_PAIR_COSINE and a not in taken and b not in taken:
            taken |= {a, b}
            pairs.append((a, b))
    return pairs


def _chain_branches(
    branches: list[Branch], partner: dict[BranchEnd, BranchEnd]
) -> list[list[Branch]]:
    """Chains of partners, followed from open ends; rings are opened anywhere."""
    chains: list[list[Branch]] = []
    used: set[int] = set()
    starts = [(k, s) for k in range(len(branches)) for s in (0, 1) if (k, s) not in partner]
    starts += [(k, 0) for k in range(len(branches))]
    for start in starts:
        if start[0] in used:
            continue
        chain: list[Branch] = []
        at: BranchEnd | None = start
        while at is not None and at[0] not in used:
            k, side = at
            used.add(k)
            b = branches[k]
            chain.append(b if side == 0 else Branch(b.pixels[::-1], (b.ends[1], b.ends[0])))
            at = partner.get((k, 1 - side))
        chains.append(chain)
    return chains


def _strand(chain: list[Branch], width: float) -> Strand:
    """Strand of a chain of branches, not clear within a rope width of junctions."""
    pixels: list[Pixel] = []
    clear: list[bool] = []
    near = max(2, round(width))
    for b in chain:
        good = [True] * len(b.pixels)
        for side, end in enumerate(b.ends):
            if end >= 0:
                span = range(min(near, len(good)))
                for k in span:
                    good[k if side == 0 else -1 - k] = False
        pixels += b.pixels
        clear += good
    return Strand(np.array(pixels, float).reshape(-1, 2)[:, ::-1].copy(), np.array(clear, bool))

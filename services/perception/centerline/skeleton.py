"""Skeleton of a mask, traced into strands.

Where strands cross, the skeleton has junctions; at each, the branches are paired so that they
continue as straight as possible. Spurs at thick places are removed.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64, UInt8

from services.perception.image.thinning import skeletonize

NEIGHBOUR_OFFSETS = [(-1, -1), (-1, 0), (-1, 1), (0, -1), (0, 1), (1, -1), (1, 0), (1, 1)]
"""Row and column offsets of a pixel's eight neighbours."""

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
    found = [_strand(chain, width) for chain in chains]
    long = [s for s in found if len(s.pixels) >= MIN_STRAND_PIXELS]
    return sorted(long, key=lambda s: -len(s.pixels))


def trace_branches(skeleton: Bool[np.ndarray, "h w"]) -> list[Branch]:
    """Return the branches of a skeleton, cut at its junctions.

    Args:
        skeleton: Whether a pixel belongs to the skeleton.
    """
    near = _neighbours(skeleton)
    crossing = {p for p, q in near.items() if len(q) > 2}
    junction = _clusters(crossing)
    branches: list[Branch] = []
    used: set[Pixel] = set()

    def follow(start: Pixel, first: Pixel | None) -> Branch:
        path, end = [start], -1
        used.add(start)
        before, here = first, start
        while True:
            onward = [q for q in near[here] if q != before and (q in crossing or q not in used)]
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
        return Branch(path, (junction[first] if first is not None else -1, end))

    for p in sorted(crossing):
        for q in near[p]:
            if q not in crossing and q not in used:
                branches.append(follow(q, p))
    for p in near:
        if p not in used and p not in crossing and len(near[p]) <= 1:
            branches.append(follow(p, None))
    for p in near:
        # The remaining pixels form closed rings.
        if p not in used and p not in crossing:
            branches.append(follow(p, None))
    return branches


def _neighbours(skeleton: Bool[np.ndarray, "h w"]) -> dict[Pixel, list[Pixel]]:
    """Return the skeleton pixels next to each one, in the order of rows, then columns."""
    rows, columns = np.nonzero(skeleton)
    offsets = np.array(NEIGHBOUR_OFFSETS)
    padded = np.pad(skeleton, 1)
    above, left = rows[:, None] + 1, columns[:, None] + 1
    beside_rows, beside_columns = above + offsets[:, 0], left + offsets[:, 1]
    near = padded[beside_rows, beside_columns]
    # A diagonal neighbour beside a straight one is the corner of a staircase, not a branch.
    corner = padded[beside_rows, left] | padded[above, beside_columns]
    near &= ~(corner & np.all(offsets != 0, axis=1))
    pixel, offset = np.nonzero(near)
    beside = (np.stack([rows, columns], axis=1)[pixel] + offsets[offset]).tolist()
    found = [(row, column) for row, column in beside]
    ends = np.cumsum(np.count_nonzero(near, axis=1)).tolist()
    pixels = zip(rows.tolist(), columns.tolist(), strict=True)
    return {p: found[a:b] for p, a, b in zip(pixels, [0, *ends[:-1]], ends, strict=True)}


def _clusters(crossing: set[Pixel]) -> dict[Pixel, int]:
    """Number of each junction pixel; pixels that touch share a number."""
    number: dict[Pixel, int] = {}
    for count, seed in enumerate(sorted(crossing)):
        if seed in number:
            continue
        stack = [seed]
        number[seed] = count
        while stack:
            r, c = stack.pop()
            for dr, dc in NEIGHBOUR_OFFSETS:
                q = (r + dr, c + dc)
                if q in crossing and q not in number:
                    number[q] = count
                    stack.append(q)
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

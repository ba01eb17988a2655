"""Fragments of ropes: pieces of a mask's skeleton between crossings and free ends.

Near a crossing the skeleton is not the centreline. It is cut off there by the largest disc in the
mask around each junction, so that what is left of a branch lies on the axis of one rope. Junctions
whose discs swallow the branch between them are one crossing.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float32, Float64

from lariat.perception.lines.skeleton import Branch, trace_branches

SPUR_WIDTHS = 1.2
"""Length up to which a branch with a free end is a spur [rope widths]."""
SPUR_RADII = 1.35
"""The same, relative to the radius of the mask at its junction [-]."""
DISC_FACTOR = 1.15
"""Radius within which a junction bends the skeleton, relative to its disc in the mask [-]."""
DIRECTION_WIDTHS = 2.5
"""Length over which the direction of a fragment's end is taken [rope widths]."""
POSE_SHARE = 0.15
"""Place in that length at which position and direction are taken, 0 at the end [-]."""
MIN_CURVED_POINTS = 8
"""Number of points from which the bend of a fragment's end is measured [-]."""
MAX_ROUNDS = 3
"""Largest number of times that spurs are removed and branches joined."""

FragmentEnd = tuple[int, int]
"""Index of a fragment, and 0 for its first or 1 for its last point."""


@dataclass(frozen=True)
class Fragment:
    """Piece of one rope between crossings."""

    points: Float64[np.ndarray, "k 2"]
    """Columns and rows, in order [pixels]."""
    junctions: tuple[int, int]
    """Crossing at its first and at its last point; -1 for a free end."""
    color: Float64[np.ndarray, "3"]
    """Median colour on its axis [Lab]."""
    radius: float
    """Median distance of its axis from the outside of the mask [pixels]."""


@dataclass(frozen=True)
class EndPose:
    """Place and direction of a fragment near one of its ends."""

    position: Float64[np.ndarray, "2"]
    """Place near the end, with the noise of single pixels smoothed away [pixels]."""
    outward: Float64[np.ndarray, "2"]
    """Unit vector along the fragment there, towards the end."""


def cut_fragments(
    skeleton: Bool[np.ndarray, "h w"],
    radii: Float32[np.ndarray, "h w"],
    lab: Float32[np.ndarray, "h w 3"],
    width: float,
) -> list[Fragment]:
    """Return the fragments of a skeleton.

    Args:
        skeleton: Skeleton of the ropes' mask.
        radii: Distance of every pixel of the mask from its outside [pixels].
        lab: Smoothed image in Lab.
        width: Width of the ropes [pixels].
    """
    branches = _clean_branches(skeleton, radii, width)
    discs = _junction_discs(branches, radii)
    pieces: list[tuple[np.ndarray, tuple[int, int]]] = []
    same: list[tuple[int, int]] = []
    for branch in branches:
        rows_columns = np.array(branch.pixels)
        kept = np.ones(len(rows_columns), bool)
        for end in set(branch.ends) - {-1}:
            center, radius = discs[end]
            kept &= np.linalg.norm(rows_columns - center, axis=1) > DISC_FACTOR * radius
        inside = np.flatnonzero(kept)
        if len(inside) == 0:
            if min(branch.ends) >= 0:
                same.append(branch.ends)
            continue
        piece = rows_columns[inside[0] : inside[-1] + 1]
        pieces.append((piece, branch.ends))
    root = _joined(same)
    return [
        Fragment(
            piece[:, ::-1].astype(float),
            (root.get(ends[0], ends[0]), root.get(ends[1], ends[1])),
            np.median(lab[piece[:, 0], piece[:, 1]], axis=0).astype(float),
            float(np.median(radii[piece[:, 0], piece[:, 1]])),
        )
        for piece, ends in pieces
    ]


def end_pose(fragment: Fragment, side: int, width: float) -> EndPose:
    """Return place and direction of a fragment near one of its ends.

    Args:
        fragment: Fragment.
        side: 0 for its first point, 1 for its last one.
        width: Width of the ropes [pixels].
    """
    count = max(2, round(DIRECTION_WIDTHS * width))
    near = fragment.points[:count] if side == 0 else fragment.points[::-1][:count]
    if len(near) < MIN_CURVED_POINTS:
        return _straight_pose(near)
    # A parabola: noise of single pixels cancels, and a bend beside the crossing does not count.
    share = np.linspace(0.0, 1.0, len(near))
    start, slope, bend = np.polynomial.polynomial.polyfit(share, near, 2)
    outward = -(slope + 2.0 * bend * POSE_SHARE)
    position = start + slope * POSE_SHARE + bend * POSE_SHARE**2
    return EndPose(position, outward / max(float(np.linalg.norm(outward)), 1e-9))


def _straight_pose(near: Float64[np.ndarray, "k 2"]) -> EndPose:
    """Place and direction of a short end, whose first point is the last of the fragment."""
    middle = near.mean(axis=0)
    if len(near) < 2:
        return EndPose(middle, np.zeros(2))
    # Direction of the largest variance: noise of single pixels cancels.
    _, _, axes = np.linalg.svd(near - middle)
    outward = axes[0] * np.sign(axes[0] @ (near[0] - near[-1]) or 1.0)
    return EndPose(middle, outward)


def _clean_branches(
    skeleton: Bool[np.ndarray, "h w"], radii: Float32[np.ndarray, "h w"], width: float
) -> list[Branch]:
    """Branches without spurs, joined where a spur has left but two at a junction."""
    branches = trace_branches(skeleton)
    for _ in range(MAX_ROUNDS):
        discs = _junction_discs(branches, radii)
        degree = Counter(end for b in branches for end in b.ends if end >= 0)
        kept = []
        for b in branches:
            inner = max(b.ends)
            free = min(b.ends) == -1 and inner >= 0
            longest = max(SPUR_WIDTHS * width, SPUR_RADII * discs[inner][1]) if free else 0.0
            if free and len(b.pixels) <= longest and degree[inner] > 2:
                degree[inner] -= 1
                continue
            kept.append(b)
        joined = _join_pairs(kept)
        if len(joined) == len(branches):
            break
        branches = joined
    return branches


def _join_pairs(branches: list[Branch]) -> list[Branch]:
    """Branches, of which the only two at a junction are made one."""
    branches = list(branches)
    degree = Counter(end for b in branches for end in b.ends if end >= 0)
    for junction in [j for j, n in degree.items() if n <= 2]:
        at = [b for b in branches if junction in b.ends]
        if len(at) == 1 and at[0].ends[0] != at[0].ends[1]:
            (b,) = at
            first, last = (-1 if end == junction else end for end in b.ends)
            branches[branches.index(b)] = Branch(b.pixels, (first, last))
        elif len(at) == 2:
            one, two = at
            first = one.pixels if one.ends[1] == junction else one.pixels[::-1]
            start = one.ends[0] if one.ends[1] == junction else one.ends[1]
            second = two.pixels if two.ends[0] == junction else two.pixels[::-1]
            stop = two.ends[1] if two.ends[0] == junction else two.ends[0]
            branches.remove(one)
            branches.remove(two)
            branches.append(Branch(first + second, (start, stop)))
    return branches


def _junction_discs(
    branches: list[Branch], radii: Float32[np.ndarray, "h w"]
) -> dict[int, tuple[Float64[np.ndarray, "2"], float]]:
    """Centre (row, column) and radius of the disc of every junction."""
    touching: dict[int, list[tuple[int, int]]] = {}
    for b in branches:
        for side, end in enumerate(b.ends):
            if end >= 0:
                touching.setdefault(end, []).append(b.pixels[0 if side == 0 else -1])
    discs = {}
    for junction, pixels in touching.items():
        center = np.mean(pixels, axis=0)
        discs[junction] = center, max(float(radii[p]) for p in pixels)
    return discs


def _joined(pairs: list[tuple[int, int]]) -> dict[int, int]:
    """Common number of all junctions that pairs connect."""
    root: dict[int, int] = {}

    def find(k: int) -> int:
        while root.get(k, k) != k:
            k = root[k]
        return k

    for a, b in pairs:
        root[find(a)] = find(b)
        root.setdefault(find(b), find(b))
    return {k: find(k) for k in list(root)}

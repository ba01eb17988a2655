"""Strands in an image that cannot be parts of the held rope.

The chain accounts for the whole length of the rope. A strand beside it belongs to the rope only
where the chain was not seen, and only if the hidden stretch is long enough to lead there and back.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Bool, Float64

from lariat.geometry import polylines
from lariat.geometry.cameras import Camera
from lariat.perception.centerline.estimate import CenterlineEstimate, RopeDimensions, ShapePrior
from lariat.perception.centerline.observation import Observation
from lariat.perception.lines.ridge import Ridge, axis_points

MIN_STRAND_WIDTHS = 2.0
"""Length below which a strand is left out, since it has no direction [rope widths]."""
MAX_WIDTHS = 2.2
"""Width above which a region is no rope but, e.g., a gripper or a hand [rope widths]."""
CHAIN_HALF_WIDTH = 0.65
"""Distance from the chain in the image up to which a pixel shows the chain [rope widths], in
addition to `CHAIN_MARGIN`."""
CHAIN_MARGIN = 1.5
"""The same [pixels]."""
DEPTH_HALF_WINDOW = 8
"""Half the window along a strand over which its depth is averaged [pixels]."""
MAX_STEP = 0.01
"""Difference in depth of two neighbouring points of one thing [m]."""
LENGTH_TOLERANCE = 1.05
"""Factor on the length of a hidden stretch within which a detour through a strand is possible."""

MAX_DETOUR_GAP = 0.025
"""Distance from the chain up to which the end of a strand may lead into it [m]."""
DETOUR_FACTOR = 1.2
"""Length of a strand, relative to the chain between its ends, up to which it may take its place."""


@dataclass(frozen=True)
class BesideStrand:
    """Piece of something else that looks like the rope."""

    pixels: Float64[np.ndarray, "k 2"]
    """Columns and rows of its axis, in order."""
    points: Float64[np.ndarray, "k 3"]
    """Points along its axis [m]."""

    @property
    def sparse(self) -> Float64[np.ndarray, "m 3"]:
        """Some of its points, both ends among them, whose noise does not lengthen it [m]."""
        count = max(2, min(20, len(self.points) // 5))
        return self.points[np.linspace(0, len(self.points) - 1, count).astype(int)]


@dataclass(frozen=True)
class StrandsBeside:
    """Strands that a chain does not cover."""

    foreign: list[BesideStrand]
    """Strands that cannot be parts of the held rope."""
    rivals: float
    """Length of strands that may take the place of a seen part of the chain, relative to its
    length [-]."""


def strands_beside_chain(
    view: Observation,
    camera: Camera,
    rope: RopeDimensions,
    chain: CenterlineEstimate,
    gripped: tuple[bool, bool],
    prior: ShapePrior | None,
) -> StrandsBeside:
    """Return the strands beside an estimate of the held rope.

    Args:
        view: Strands of the frame.
        camera: Camera of the frame.
        rope: Length and number of nodes of the held rope.
        chain: Estimate of the held rope.
        gripped: Whether a grip holds the left and the right end.
        prior: Expected shape of the held rope.
    """
    stretches = list(_hidden_stretches(chain, gripped, rope.length / (rope.node_count - 1)))
    foreign, rivals = [], 0.0
    for strand in _uncovered(view, camera, rope.radius, chain.positions):
        if _is_off(strand, prior):
            foreign.append(strand)
        elif _is_detour(strand, chain):
            rivals += polylines.length(strand.sparse) / rope.length
        elif not any(h.may_hold(strand) for h in stretches):
            foreign.append(strand)
    return StrandsBeside(foreign, rivals)


def between_steps(
    ridge: Ridge, camera: Camera, radius: float, least: float
) -> Iterator[BesideStrand]:
    """Yield the strands of a ridge between steps of its depth, where it leads over another thing.

    Args:
        ridge: Ridge.
        camera: Camera of the image.
        radius: Distance of the axis behind the surface [m].
        least: Least length of a strand [pixels].
    """
    (finite,) = np.nonzero(np.isfinite(ridge.depth))
    steps = np.abs(np.diff(ridge.depth[finite])) > MAX_STEP
    for run in np.split(finite, np.flatnonzero(steps) + 1):
        if len(run) >= least:
            part = ridge.part(slice(run[0], run[-1] + 1))
            yield BesideStrand(part.pixels, axis_points(part, camera, radius, DEPTH_HALF_WINDOW))


def _uncovered(
    view: Observation, camera: Camera, radius: float, nodes: Float64[np.ndarray, "n 3"]
) -> Iterator[BesideStrand]:
    """Yield the parts of all strands that a chain does not cover in the image.

    Args:
        view: Strands of the frame.
        camera: Camera of the frame.
        radius: Radius of the rope [m].
        nodes: Nodes of the chain [m].
    """
    dense = camera.project(polylines.resample(nodes, 4 * len(nodes)))[0]
    reach = CHAIN_HALF_WIDTH * view.width + CHAIN_MARGIN
    shortest = MIN_STRAND_WIDTHS * view.width
    for ridge in view.ridges:
        distance = polylines.least_distances(ridge.pixels, dense)
        for run in runs(distance > reach):
            wide = np.median(view.width_at(ridge.pixels[run])) > MAX_WIDTHS * view.width
            if not wide:
                yield from between_steps(ridge.part(run), camera, radius, shortest)


@dataclass(frozen=True)
class _HiddenStretch:
    """Stretch of the chain that was not observed."""

    start: Float64[np.ndarray, "3"] | None
    """Where it begins [m]; None at a free end."""
    end: Float64[np.ndarray, "3"] | None
    """Where it ends [m]."""
    length: float
    """Length of rope in it [m]."""

    def may_hold(self, strand: BesideStrand) -> bool:
        """Return whether the rope may run through a strand within the stretch."""
        points, detours = strand.sparse, []
        for first, last in ((points[0], points[-1]), (points[-1], points[0])):
            detour = polylines.length(points)
            if self.start is not None:
                detour += float(np.linalg.norm(first - self.start))
            if self.end is not None:
                detour += float(np.linalg.norm(self.end - last))
            detours.append(detour)
        return min(detours) <= LENGTH_TOLERANCE * self.length


def _hidden_stretches(
    chain: CenterlineEstimate, gripped: tuple[bool, bool], edge: float
) -> Iterator[_HiddenStretch]:
    nodes, located = chain.positions, chain.observed.copy()
    located[0] |= gripped[0]
    located[-1] |= gripped[1]
    fixed = np.flatnonzero(located).tolist()
    bounds = [*([] if gripped[0] else [None]), *fixed, *([] if gripped[1] else [None])]
    last = len(nodes) - 1
    for a, b in itertools.pairwise(bounds):
        first, end = (0 if a is None else a), (last if b is None else b)
        if end - first > 1 or a is None or b is None:
            yield _HiddenStretch(
                None if a is None else nodes[a],
                None if b is None else nodes[b],
                (end - first) * edge,
            )


def _is_detour(strand: BesideStrand, chain: CenterlineEstimate) -> bool:
    """Whether a strand begins and ends beside the chain and is as long as the chain between."""
    points = strand.points[[0, -1]]
    dense = polylines.resample(chain.positions, 4 * len(chain.positions))
    gaps = polylines.point_distances(points, dense)
    first, last = np.argmin(gaps, axis=1)
    if np.max(np.min(gaps, axis=1)) > MAX_DETOUR_GAP:
        return False
    along = abs(int(last) - int(first)) * polylines.length(dense) / (len(dense) - 1)
    detour = polylines.length(strand.sparse)
    return detour + float(np.sum(np.min(gaps, axis=1))) < DETOUR_FACTOR * along + MAX_DETOUR_GAP


def _is_off(strand: BesideStrand, prior: ShapePrior | None) -> bool:
    """Whether a strand lies away from where the rope is expected."""
    if prior is None:
        return False
    points = strand.sparse
    distances = polylines.point_distances(points, prior.positions)
    nearest = np.argmin(distances, axis=1)
    least = distances[np.arange(len(points)), nearest]
    return bool(np.median(least - prior.reach[nearest]) > 0.0)


def runs(mask: Bool[np.ndarray, "k"]) -> Iterator[slice]:
    """Yield the stretches of consecutive true values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], mask, [False]]).astype(np.int8)))
    for start, stop in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        yield slice(start, stop)

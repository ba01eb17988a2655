"""Initial chains for the fit: one for each hypothesis about the order of the segments."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines
from lariat.geometry.poses import Pose
from lariat.perception.centerline.estimate import RopeDimensions, ShapePrior
from lariat.perception.centerline.gap_bridging import hidden_end_length, join_segments
from lariat.perception.centerline.observation import Observation
from lariat.perception.centerline.segment_ordering import (
    SegmentOrder,
    order_by_gaps,
    order_by_prior,
)

UNIFORM_HALF_WIDTH = 3.0**0.5
"""Half width of a uniform distribution over its standard deviation."""

MAX_STRAY_POINTS = 12
"""Number of points of a segment away from an expected shape up to which it is wholly the rope's."""


@dataclass(frozen=True)
class InitialChain:
    """Initial guess of a fit, with the assignment of segments to its edges."""

    nodes: Float64[np.ndarray, "n 3"]
    """Node positions [m]."""
    edges: tuple[tuple[int, np.ndarray], ...]
    """Index of each segment, and for each of its points the edge of the chain on which it lies; -1:
    none."""
    prior: ShapePrior | None
    """Expected shape from which it was made; None where there is none."""
    sliding: float = 0.0
    """Standard deviation of a shift of the whole rope along itself [m]."""


def initial_chains(
    view: Observation,
    rope: RopeDimensions,
    reach: float,
    left: Pose | None,
    right: Pose | None,
    prior: ShapePrior | None,
    fallback_prior: Callable[[], ShapePrior | None] | None,
) -> Iterator[InitialChain]:
    """Yield initial chains, the most likely first.

    Args:
        view: Segments in the frame.
        rope: Length and number of nodes.
        reach: Distance from a prior above which a segment does not belong to it [m], in addition
            to two of the prior's standard deviations.
        left: Grip of the left end; None when it is free or unknown.
        right: Grip of the right end.
        prior: Expected shape.
        fallback_prior: Function that returns an expected shape; it is called last.
    """
    if prior is not None:
        yield from _from_prior(view, rope, reach, prior, left, right)
    for order in order_by_gaps(view.points, left, right, rope.length):
        yield _from_order(view, rope, order, left, right, None)
    if fallback_prior is not None:
        shape = fallback_prior()
        if shape is not None:
            yield from _from_prior(view, rope, reach, shape, left, right)


def _from_prior(
    view: Observation,
    rope: RopeDimensions,
    reach: float,
    prior: ShapePrior,
    left: Pose | None,
    right: Pose | None,
) -> Iterator[InitialChain]:
    """Chains with segments assigned by a prior, as whole segments and by single points.

    Where a segment leaves the expected shape, it is partly or wholly another rope, and single
    points come first.
    """
    far_reach = reach + 2.0 * float(np.max(prior.sigma))

    def whole() -> Iterator[InitialChain]:
        order = order_by_prior(prior.positions, view.points, far_reach)
        if order.indices:
            yield _from_order(view, rope, order, left, right, prior)

    if len(view.points) == 1:
        # One segment alone is no other rope, and is mostly accepted as a whole.
        yield from whole()
        yield _by_points(view, rope, far_reach, prior)[0]
        return
    by_points, strays = _by_points(view, rope, far_reach, prior)
    yield from (by_points, *whole()) if strays else (*whole(), by_points)


def _by_points(
    view: Observation, rope: RopeDimensions, far_reach: float, prior: ShapePrior
) -> tuple[InitialChain, bool]:
    """Chain with single points assigned by a prior, and whether many of a segment are away.

    Where segments merge in the image, only single points can tell them apart.
    """
    dense = polylines.resample(prior.positions, 4 * rope.node_count)
    edges, strays = [], False
    for points in view.points:
        gaps = polylines.point_distances(points, dense)
        nearest = np.argmin(gaps, axis=1)
        node = nearest * (rope.node_count - 1) // len(dense)
        far = gaps[np.arange(len(points)), nearest] > np.minimum(far_reach, prior.reach[node])
        edges.append(np.where(far, -1, node))
        strays |= int(np.count_nonzero(far)) > MAX_STRAY_POINTS
    return InitialChain(prior.positions, tuple(enumerate(edges)), prior), strays


def _from_order(
    view: Observation,
    rope: RopeDimensions,
    order: SegmentOrder,
    left: Pose | None,
    right: Pose | None,
    prior: ShapePrior | None,
) -> InitialChain:
    """Chain through the segments in a given order."""
    n = rope.node_count
    segments = [
        view.points[i][::-1] if flip else view.points[i]
        for i, flip in zip(order.indices, order.flipped, strict=True)
    ]
    curve, places = join_segments(segments, left, right, rope.length)
    edges = tuple(
        (i, np.minimum((place[::-1] if flip else place) * (n - 1), n - 2).astype(int))
        for i, flip, place in zip(order.indices, order.flipped, places, strict=True)
    )
    sliding = 0.0
    if left is None and right is None:
        # The rope may be shifted along itself as long as its ends stay out of view.
        hidden = hidden_end_length(segments, None, None, rope.length)
        sliding = hidden / UNIFORM_HALF_WIDTH
    return InitialChain(polylines.resample(curve, n), edges, prior, sliding)

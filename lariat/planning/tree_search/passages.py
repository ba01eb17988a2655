"""Narrow passages of a scene: places between obstacles, and directions in which a rope fits.

A place is the middle of two points inside obstacles and is free itself (the bridge test of Hsu et
al., ICRA 2003). It then moves to where a straight piece of rope has most room, and one of several
passages that agree is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import scene_distance, signed_distance
from lariat.planning.problem import Problem

POINT_COUNT = 300
"""Number of points that are sampled in each obstacle."""
PAIR_COUNT = 20000
"""Number of pairs of these points that are compared."""
WIDTH_RANGE = (0.015, 0.35)
"""Range of the distance between such a pair of points [m]."""
MAX_CANDIDATES = 120
"""Largest number of places that are improved."""
DIRECTION_COUNT = 16
"""Number of directions of the rope that are compared at a place."""
PROBE_SHARE = 0.2
"""Half length of the piece of rope whose room is compared, in rope lengths [-]."""
OPEN_SHARE = 0.3
"""Distance before and behind a place at which the openness of the scene is compared, in rope
lengths [-]."""
PROBE_COUNT = 13
"""Number of points of that piece."""
IMPROVEMENT_COUNT = 60
"""Number of random changes of a place and its direction."""
PLACE_SIGMAS = (0.012, 0.0005)
"""Standard deviations of the first and the last change of place along each axis [m]."""
DIRECTION_SIGMAS = (0.2, 0.01)
"""Standard deviations of the first and the last change of direction [rad]."""
MAX_SHIFT = 0.1
"""Largest distance of an improved place from where it was found [m]."""
MIN_DISTANCE = 0.06
"""Distance of two passages above which both are kept [m]."""
MIN_ANGLE = 0.5
"""Angle between two passages above which both are kept [rad]."""
MAX_PASSAGES = 12
"""Largest number of passages."""


@dataclass(frozen=True)
class Passages:
    """Narrow passages."""

    places: Float64[np.ndarray, "p 3"]
    """Places [m]."""
    directions: Float64[np.ndarray, "p 3"]
    """Unit vectors along the rope."""

    def __len__(self) -> int:
        return len(self.places)


def find_passages(
    problem: Problem,
    low: Float64[np.ndarray, "3"],
    high: Float64[np.ndarray, "3"],
    margin: float,
    random: np.random.Generator,
) -> Passages:
    """Return the narrow passages in a box.

    Args:
        low: Lowest corner of the box [m].
        high: Highest corner [m].
        margin: Distance that the rope's centreline keeps from obstacles [m].
    """
    inner = _points_inside(problem, low, high, random)
    if not len(inner):
        return Passages(inner, inner)
    one, other = inner[random.integers(0, len(inner), (2, PAIR_COUNT))]
    width = np.linalg.norm(other - one, axis=1)
    near = (width > WIDTH_RANGE[0]) & (width < WIDTH_RANGE[1])
    middle, way = 0.5 * (one + other)[near], (other - one)[near] / width[near, None]
    # Those without room get some by the improvement, or are left out after it.
    free = scene_distance(middle, problem.solid) > 0.0
    middle, way = middle[free][:MAX_CANDIDATES], way[free][:MAX_CANDIDATES]
    if not len(middle):
        return Passages(middle, middle)
    across = random.normal(size=(len(middle), DIRECTION_COUNT, 3))
    across -= np.sum(across * way[:, None], axis=2, keepdims=True) * way[:, None]
    across = poses.normalized(across)
    room = _room(problem, np.broadcast_to(middle[:, None], across.shape), across)
    best = np.argmax(room, axis=1)
    row = np.arange(len(middle))
    along, room, places = across[row, best], room[row, best], middle
    sigmas = (np.geomspace(*pair, IMPROVEMENT_COUNT) for pair in (PLACE_SIGMAS, DIRECTION_SIGMAS))
    for place_sigma, direction_sigma in zip(*sigmas, strict=True):
        # Across the rope alone: along it, the place would leave its passage.
        shift = random.normal(scale=place_sigma, size=places.shape)
        moved = places + shift - np.sum(shift * along, axis=1, keepdims=True) * along
        turned = poses.normalized(along + random.normal(scale=direction_sigma, size=along.shape))
        new_room = _room(problem, moved, turned)
        better = (new_room > room) & (np.linalg.norm(moved - middle, axis=1) < MAX_SHIFT)
        places = np.where(better[:, None], moved, places)
        along = np.where(better[:, None], turned, along)
        room = np.where(better, new_room, room)
    fits = room > margin
    return _distinct(problem, places[fits], along[fits])


def _room(
    problem: Problem,
    places: Float64[np.ndarray, "*b 3"],
    directions: Float64[np.ndarray, "*b 3"],
) -> Float64[np.ndarray, "*b"]:
    """Least distance of short straight pieces of rope from all obstacles [m]."""
    reach = PROBE_SHARE * problem.rod.properties.length * np.linspace(-1.0, 1.0, PROBE_COUNT)
    probes = places[..., None, :] + reach[:, None] * directions[..., None, :]
    return scene_distance(probes, problem.solid).min(axis=-1)


def _distinct(
    problem: Problem,
    places: Float64[np.ndarray, "p 3"],
    directions: Float64[np.ndarray, "p 3"],
) -> Passages:
    """Passages of which no two are alike, those that lead from one open space to another first."""
    reach = OPEN_SHARE * problem.rod.properties.length * np.array([-1.0, 0.0, 1.0])
    probes = places[:, None] + reach[:, None] * directions[:, None]
    depth = scene_distance(probes, problem.solid)
    kept: list[int] = []
    for k in np.argsort(depth[:, 1] - np.minimum(depth[:, 0], depth[:, 2]), kind="stable"):
        apart = np.linalg.norm(places[kept] - places[k], axis=1) / MIN_DISTANCE
        cosine = np.clip(np.abs(directions[kept] @ directions[k]), 0.0, 1.0)
        if np.all(apart + np.arccos(cosine) / MIN_ANGLE > 1.0):
            kept.append(int(k))
        if len(kept) == MAX_PASSAGES:
            break
    return Passages(places[kept], directions[kept])


def _points_inside(
    problem: Problem,
    low: Float64[np.ndarray, "3"],
    high: Float64[np.ndarray, "3"],
    random: np.random.Generator,
) -> Float64[np.ndarray, "p 3"]:
    """Random points inside the obstacles, as many in each [m]."""
    inside = []
    for obstacle in problem.solid:
        if obstacle.shape == "half_space":
            # Just below its surface.
            points = random.uniform(low, high, (POINT_COUNT, 3))
            normal = poses.rotate(
                np.array(obstacle.orientation), poses.normalized(np.array(obstacle.normal))
            )
            points -= (signed_distance(points, obstacle)[:, None] + 1e-3) * normal
        else:
            half = obstacle.row.support(obstacle.packed_sizes, np.eye(3))
            local = random.uniform(-half, half, (POINT_COUNT, 3))
            turned = np.broadcast_to(np.array(obstacle.orientation), (len(local), 4))
            points = np.array(obstacle.position) + poses.rotate(turned, local)
        near = np.all((points > low - WIDTH_RANGE[1]) & (points < high + WIDTH_RANGE[1]), axis=1)
        inside.append(points[near & (signed_distance(points, obstacle) < 0.0)])
    return np.concatenate(inside) if inside else np.zeros((0, 3))

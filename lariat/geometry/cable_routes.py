"""Routes of cables: an ordered list of clips that hold the cable and pegs that it passes.

A clip is two round legs among the obstacles, `NAME-left` and `NAME-right`, left and right of the
cable that passes it from its left end to its right end. A peg is any other obstacle. An entry of a
route is the name of a clip, or `left of NAME` or `right of NAME` for a peg that the cable passes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.obstacles import Obstacle

LEGS = ("-left", "-right")
"""What the names of a clip's legs add to its own."""
SIDES_OF_PEGS = {"left of ": 1.0, "right of ": -1.0}
"""Begin of the entry of a peg, and the side of it, positive to the left."""

LEAST_SLACK = 0.007
"""Share of a cable by which it is longer than its route [-]."""
LEAST_TAIL = 0.1
"""Share to which a tail may be shortened [-]."""


@dataclass(frozen=True)
class ClipOpening:
    """Opening of a clip between its legs."""

    name: str
    """Name of the clip."""
    foot: Float64[np.ndarray, "3"]
    """Middle between the feet of the legs [m]."""
    along: Float64[np.ndarray, "3"]
    """Direction of the cable, level."""
    half_width: float
    """Half the distance between the legs' axes [m]."""
    height: float
    """Height of the tips above the feet [m]."""

    @property
    def left(self) -> Float64[np.ndarray, "3"]:
        """Direction from the right leg to the left one."""
        return np.cross(np.array([0.0, 0.0, 1.0]), self.along)

    def crossings(self, nodes: Float64[np.ndarray, "n 3"]) -> Float64[np.ndarray, "c 2"]:
        """Return where a cable passes the plane of the legs: to the left, and above the foot [m].

        Args:
            nodes: Nodes of its centreline [m].
        """
        along = (nodes - self.foot) @ self.along
        (crossing,) = np.nonzero((along[:-1] <= 0.0) != (along[1:] <= 0.0))
        share = along[crossing] / (along[crossing] - along[crossing + 1])
        here = nodes[crossing] + share[:, None] * (nodes[crossing + 1] - nodes[crossing])
        return np.stack([(here - self.foot) @ self.left, here[:, 2] - self.foot[2]], axis=1)

    def holds(self, nodes: Float64[np.ndarray, "n 3"]) -> bool:
        """Return whether a cable passes between the legs and below their tips.

        Args:
            nodes: Nodes of its centreline [m].
        """
        left, up = self.crossings(nodes).T
        return bool(np.any((np.abs(left) < self.half_width) & (up > 0.0) & (up < self.height)))

    def miss(self, nodes: Float64[np.ndarray, "n 3"]) -> str:
        """Return in words how a cable misses the opening.

        Args:
            nodes: Nodes of its centreline [m].
        """
        crossings = self.crossings(nodes)
        if not len(crossings):
            return "ends before it"
        left, up = min(crossings, key=lambda at: abs(at[0]))
        if abs(left) < self.half_width:
            return f"lies {1e3 * (up - self.height):.1f} mm above its tips"
        side = "left" if left > 0.0 else "right"
        return f"passes {1e3 * abs(left):.1f} mm to the {side} of its middle"


@dataclass(frozen=True)
class RouteStop:
    """Place of a route at which the cable is held, or bends around a peg."""

    entry: str
    """Entry of the route."""
    place: Float64[np.ndarray, "3"]
    """Point of the centreline of a cable that lies there [m]."""
    along: Float64[np.ndarray, "3"]
    """Direction of the cable there, level."""
    clip: ClipOpening | None
    """Opening of the clip; None for a peg."""


def clip_openings(obstacles: Sequence[Obstacle]) -> dict[str, ClipOpening]:
    """Return the openings of all clips among obstacles, by the clips' names."""
    bodies = {o.name: o for o in obstacles}
    openings = {}
    for name, left in bodies.items():
        right = bodies.get(name.removesuffix(LEGS[0]) + LEGS[1])
        if name.endswith(LEGS[0]) and right is not None:
            middle = 0.5 * (np.array(left.position) + np.array(right.position))
            apart = np.array(left.position) - np.array(right.position)
            half = 0.5 * left.height + left.radius
            openings[name.removesuffix(LEGS[0])] = ClipOpening(
                name.removesuffix(LEGS[0]),
                # The lower cap of a leg lies below its foot.
                middle - np.array([0.0, 0.0, half - left.radius]),
                poses.normalized(np.cross(apart, np.array([0.0, 0.0, 1.0]))),
                0.5 * float(np.linalg.norm(apart)),
                2.0 * half - left.radius,
            )
    return openings


def peg_of(entry: str) -> tuple[str, float]:
    """Return the peg's name in an entry of a route, and the side of it; an entry itself and 0 for
    a clip."""
    for begin, side in SIDES_OF_PEGS.items():
        if entry.startswith(begin):
            return entry.removeprefix(begin), side
    return entry, 0.0


def legs_of(clip: str) -> tuple[str, str]:
    """Return the names of the left and the right leg of a clip."""
    return clip + LEGS[0], clip + LEGS[1]


def clip_names(route: Sequence[str]) -> list[str]:
    """Return the clips of a route."""
    return [entry for entry in route if not peg_of(entry)[1]]


def held_clips(
    route: Sequence[str], obstacles: Sequence[Obstacle], nodes: Float64[np.ndarray, "n 3"]
) -> list[str]:
    """Return the names of a route's clips that hold a cable.

    Args:
        route: The route.
        obstacles: Obstacles, with the legs of the clips.
        nodes: Nodes of the cable's centreline [m].
    """
    openings = clip_openings(obstacles)
    return [name for name in clip_names(route) if name in openings and openings[name].holds(nodes)]


def stops_of(
    route: Sequence[str],
    obstacles: Sequence[Obstacle],
    ends: Float64[np.ndarray, "2 3"],
    radius: float,
) -> tuple[RouteStop, ...]:
    """Return the stops of a route, from the left end of the cable to the right one.

    A cable lies as high above the foot of the last clip before a peg, or the first after it, as it
    is thick; it touches the pegs. A peg from which it would have to bend away is no stop: the cable
    passes it at a distance.

    Args:
        route: The route.
        obstacles: Obstacles, with the legs of the clips.
        ends: Places of the cable's ends [m].
        radius: Radius of the cable [m].

    Raises:
        ValueError: The route names something that is not there, or no clip, or passes a clip
            against its heading.
    """
    openings, bodies = clip_openings(obstacles), {o.name: o for o in obstacles}
    for entry in route:
        name, side = peg_of(entry)
        if side and name in openings:
            raise ValueError(f"{name!r} is a clip, which the route passes through: {name!r} alone")
        if not side and name not in openings:
            known = ", ".join(openings) or "none"
            raise ValueError(
                f"the route names {entry!r}, which is no clip (there are: {known}); a peg is "
                "passed 'left of NAME' or 'right of NAME'"
            )
        if side and name not in bodies:
            raise ValueError(f"the route names the peg {name!r}, and no obstacle has this name")
    clips = [openings[entry] for entry in route if entry in openings]
    if not clips:
        raise ValueError("the route has no clip; give at least one, where laying begins")
    centres = np.array([ends[0], *(_centre(entry, openings, bodies) for entry in route), ends[1]])
    ways = np.diff(centres, axis=0)
    for k, entry in enumerate(route):
        if entry in openings and np.min(ways[k : k + 2] @ openings[entry].along) < 0.0:
            raise ValueError(
                f"the route passes clip {entry!r} against its heading; move it in the order, or "
                "turn the clip"
            )
    stops = list(_stops(route, openings, bodies, centres, clips[0].foot[2] + radius, radius))
    while np.max(bends := _bends(stops, ends)) > 0.0:
        del stops[int(np.argmax(bends))]
    return tuple(stops)


def _bends(
    stops: Sequence[RouteStop], ends: Float64[np.ndarray, "2 3"]
) -> Float64[np.ndarray, "k"]:
    """Sine of the angle by which a cable at each stop bends away from its peg; 0 at clips."""
    points = np.array([ends[0], *(stop.place for stop in stops), ends[1]])
    edges = poses.normalized(np.diff(points, axis=0) * np.array([1.0, 1.0, 0.0]))
    return np.cross(edges[:-1], edges[1:])[:, 2] * [peg_of(stop.entry)[1] for stop in stops]


def _centre(
    entry: str, openings: dict[str, ClipOpening], bodies: dict[str, Obstacle]
) -> Float64[np.ndarray, "3"]:
    """Middle of a clip, or of a peg [m]."""
    opening = openings.get(entry)
    return np.array(bodies[peg_of(entry)[0]].position) if opening is None else opening.foot


def _stops(
    route: Sequence[str],
    openings: dict[str, ClipOpening],
    bodies: dict[str, Obstacle],
    centres: Float64[np.ndarray, "k 3"],
    height: float,
    radius: float,
) -> Iterator[RouteStop]:
    up = np.array([0.0, 0.0, 1.0])
    for entry, before, here, after in zip(
        route, centres[:-2], centres[1:-1], centres[2:], strict=True
    ):
        opening = openings.get(entry)
        if opening is not None:
            height = opening.foot[2] + radius
            yield RouteStop(entry, opening.foot + radius * up, opening.along, opening)
            continue
        name, side = peg_of(entry)
        along = poses.normalized((after - before) * np.array([1.0, 1.0, 0.0]))
        left = np.cross(up, along)
        away = float(bodies[name].support_along(side * left)) + radius
        place = here + side * away * left
        yield RouteStop(entry, np.array([*place[:2], height]), along, None)


def laid_chain(
    stops: Sequence[RouteStop], ends: Float64[np.ndarray, "2 3"], length: float, count: int
) -> tuple[Float64[np.ndarray, "n 3"], Float64[np.ndarray, "k"]]:
    """Return nodes of a cable that lies along a route, and the places of the stops along it [m].

    What the cable is longer than the route lies in both tails, in proportion to their lengths.

    Args:
        stops: Stops of the route.
        ends: Places of the cable's ends [m].
        length: Length of the cable [m].
        count: Number of nodes.

    Raises:
        ValueError: The cable is too short for the route.
    """
    points = np.array([ends[0], *(stop.place for stop in stops), ends[1]])
    straight = polylines.arc_lengths(points)
    between = straight[-2] - straight[1]
    share = (length - between) / (straight[-1] - between)
    if share < 1.0:
        raise ValueError(
            f"the route is {straight[-1]:.4f} m long, the cable {length:.4f} m; bring the ends "
            "nearer to the first and the last stop"
        )
    at = straight + (share - 1.0) * straight[1]
    at[0], at[-1] = 0.0, length
    even = np.linspace(0.0, length, count)
    nodes = np.stack([np.interp(even, at, points[:, k]) for k in range(3)], axis=1)
    return nodes, at[1:-1]


def fitted_ends(
    stops: Sequence[RouteStop], ends: Float64[np.ndarray, "2 3"], length: float
) -> Float64[np.ndarray, "2 3"]:
    """Return the places of a cable's ends, nearer to their stops where it is too short [m].

    Both tails are shortened by the same share; their ends keep their heights.

    Args:
        stops: Stops of the route.
        ends: Wanted places of the ends [m].
        length: Length of the cable [m].
    """
    places = np.array([stop.place for stop in stops])
    tails, shares = ends - places[[0, -1]], np.linspace(LEAST_TAIL, 1.0, 50)
    shortened = np.stack([shares, shares, np.ones_like(shares)], axis=1)
    lengths = sum(np.linalg.norm(shortened * tail, axis=1) for tail in tails)
    free = (1.0 - LEAST_SLACK) * length - polylines.length(places)
    share = np.interp(free, lengths, shares)
    return places[[0, -1]] + np.array([share, share, 1.0]) * tails


def tail_directions(
    stops: Sequence[RouteStop], ends: Float64[np.ndarray, "2 3"]
) -> tuple[Float64[np.ndarray, "3"], Float64[np.ndarray, "3"]]:
    """Return the level directions of both tails of a route, from left to right.

    Args:
        stops: Stops of the route.
        ends: Places of the cable's ends [m].
    """
    level = np.array([1.0, 1.0, 0.0])
    first, last = stops[0].place - ends[0], ends[1] - stops[-1].place
    return poses.normalized(level * first), poses.normalized(level * last)

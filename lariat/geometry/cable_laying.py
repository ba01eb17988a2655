"""Motion of a cable's ends that lays it along a route, from one clip outward to both sides.

Over the clip nearest to its middle the cable hangs in a vertical plane along the clip, and is
lowered into it. Each end then goes outward and down, so that the cable comes to lie from there to
the next stop in the plane of its free part, which is lowered into a clip from above. Beyond a clip,
and at a peg, the end swings to the direction of the next stop; the free part is steep and nearly
taut, so that it passes over the legs of a clip that is near. Nothing that lies is moved but for the
short piece beyond the clip.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.cable_routes import RouteStop
from lariat.geometry.grips import Grips
from lariat.geometry.poses import Pose


@dataclass(frozen=True)
class LayingSettings:
    """Shape of the free part of a cable, and steps of its ends."""

    slope: float = 0.85
    """Height that an end has more for each length of cable that is free beyond what hangs at the
    end of the motion [-]."""
    last_slope: float = 0.25
    """Height of an end over the free length at the end of the motion [-]."""
    sway: float = 1.01
    """Factor on the height in the distance that a free part spans, whose ends are level [-]."""
    stretch: float = 0.995
    """Share of the largest distance that a free part spans [-]."""
    margin: float = 0.015
    """Length that lies beyond another clip before the end swings about it [m]."""
    first_margin: float = 0.015
    """Length that lies beyond the first clip on both sides before the ends swing [m]."""
    step: float = 0.01
    """Length that is laid between two waypoints [m]."""
    swing_lever: float = 0.1
    """Lever arm that converts a swing into a laid length [m]."""


TRIED_SETTINGS = (
    LayingSettings(),
    LayingSettings(first_margin=0.045),
    LayingSettings(slope=0.8, sway=1.03),
)
"""Settings that are tried in turn."""


@dataclass(frozen=True)
class _Moment:
    """Free part of a cable on one side at one moment."""

    cost: float
    """What has been laid and swung since the beginning [m]."""
    base: Float64[np.ndarray, "3"]
    """Place where the free part begins [m]."""
    heading: float
    """Angle of its outward direction about the world's z [rad]."""
    free: float
    """Its length [m]."""
    shift: float
    """What the end is farther away than the free part spans [m]."""


def laying_waypoints(
    stops: Sequence[RouteStop],
    places: Float64[np.ndarray, "k"],
    grips: tuple[Pose, Pose],
    length: float,
    rotates: tuple[bool, bool],
    aims: Float64[np.ndarray, "k 3"],
    settings: LayingSettings,
) -> Grips:
    """Return the waypoints of both grips while a cable is laid.

    At the first waypoint the cable touches the foot of the clip at which laying begins.

    Args:
        stops: Stops of the route, from left to right.
        places: Their places along the cable [m].
        grips: Poses of the ends at the goal.
        length: Length of the cable [m].
        rotates: Whether each end rotates.
        aims: Displacements of the places at which the ends aim from the stops [m].
        settings: Shape of the free part, and steps.
    """
    first = middle_clip(stops, places, length)
    sides = (
        list(_moments(stops[first::-1], aims[first::-1], places[first], grips[0], -1.0, settings)),
        list(
            _moments(stops[first:], aims[first:], length - places[first], grips[1], 1.0, settings)
        ),
    )
    most = max(moments[-1].cost for moments in sides)
    count = 1 + int(np.ceil(most / settings.step))
    positions, orientations = np.zeros((count, 2, 3)), np.zeros((count, 2, 4))
    for end, (moments, grip) in enumerate(zip(sides, grips, strict=True)):
        costs = np.array([m.cost for m in moments])
        columns = np.array([[*m.base, m.heading, m.free, m.shift] for m in moments])
        at = np.linspace(0.0, costs[-1], count)
        rows = np.stack([np.interp(at, costs, c) for c in columns.T], axis=1)
        heading, free, shift = rows[:, 3], rows[:, 4], rows[:, 5]
        rise = _rise(free, free[-1], grip.position[2] - rows[-1, 2], settings)
        reach = _span(free, rise, settings) + shift
        outward = np.stack([np.cos(heading), np.sin(heading), np.zeros(count)], axis=1)
        positions[:, end] = rows[:, :3] + reach[:, None] * outward
        positions[:, end, 2] += rise
        turns = np.zeros((count, 3))
        turns[:, 2] = (heading - heading[-1]) * rotates[end]
        orientations[:, end] = poses.multiply(
            poses.exponential(turns), np.tile(grip.orientation, (count, 1))
        )
    return Grips(positions, orientations)


def middle_clip(stops: Sequence[RouteStop], places: Float64[np.ndarray, "k"], length: float) -> int:
    """Return the index of the clip that is nearest to the middle of a cable; see
    `laying_waypoints`."""
    clips = [k for k, stop in enumerate(stops) if stop.clip is not None]
    return min(clips, key=lambda k: abs(places[k] - 0.5 * length))


def _moments(
    stops: Sequence[RouteStop],
    aims: Float64[np.ndarray, "k 3"],
    length: float,
    grip: Pose,
    side: float,
    settings: LayingSettings,
) -> Iterator[_Moment]:
    """Moments at which the motion of one end changes.

    Args:
        stops: Stops outward from the one at which laying begins.
        aims: Displacements of the places at which the end aims from them [m].
        length: Length of the cable from there to the end [m].
        grip: Pose of the end at the goal.
        side: Whether outward is from left to right (1) or not (-1).
        settings: Shape of the free part.
    """
    heading = _angle(side * stops[0].along)
    points = [*(stop.place for stop in stops), np.array([*grip.position[:2], stops[-1].place[2]])]
    cost, free = 0.0, length
    yield _Moment(cost, points[0], heading, free, 0.0)
    for k, (here, there) in enumerate(pairwise(points)):
        apart = float(np.linalg.norm(there - here))
        margin = settings.margin if k else settings.first_margin
        margin = min(margin, 0.5 * apart) if stops[k].clip else 0.0
        last = k == len(points) - 2
        cost, free = cost + margin, free - margin
        yield _Moment(cost, here + margin * _outward(heading), heading, free, 0.0)
        turn = _angle(there + (np.zeros(3) if last else aims[k + 1]) - here) - heading
        turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
        heading += turn
        base = here + margin * _outward(heading)
        cost += settings.swing_lever * abs(turn)
        yield _Moment(cost, base, heading, free, 0.0)
        laid, shift = apart - margin, 0.0
        if last:
            rise = grip.position[2] - here[2]
            hanging = min(rise / settings.last_slope, free)
            laid = free - hanging
            shift = apart - margin - laid - float(_span(hanging, rise, settings))
        cost, free = cost + laid, free - laid
        yield _Moment(cost, base + laid * _outward(heading), heading, free, shift)


def _rise(
    free: Float64[np.ndarray, "w"], last: float, last_rise: float, settings: LayingSettings
) -> Float64[np.ndarray, "w"]:
    """Height of an end above where its free part begins [m]."""
    return last_rise + settings.slope * (free - last)


def _span(
    free: Float64[np.ndarray, "*w"] | float,
    rise: Float64[np.ndarray, "*w"] | float,
    settings: LayingSettings,
) -> Float64[np.ndarray, "*w"]:
    """Level distance that a free part spans [m]."""
    level = np.maximum(np.square(free) - np.square(settings.sway * rise), 0.0)
    return settings.stretch * np.sqrt(level)


def _angle(direction: Float64[np.ndarray, "3"]) -> float:
    return float(np.arctan2(direction[1], direction[0]))


def _outward(heading: float) -> Float64[np.ndarray, "3"]:
    return np.array([np.cos(heading), np.sin(heading), 0.0])

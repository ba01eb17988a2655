"""Rod that is laid along a route, in steps that follow its history without inertia.

How a cable is laid is chosen so that it comes to lie in all clips with another friction and another
yield curvature, too, which are seldom known.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from jaxtyping import Float64

from lariat.geometry.cable_laying import (
    TRIED_SETTINGS,
    LayingSettings,
    laying_waypoints,
    middle_clip,
)
from lariat.geometry.cable_routes import LEGS, ClipOpening, RouteStop, laid_chain
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import Obstacle, pack_supports
from lariat.geometry.poses import Pose
from lariat.rod.results import Rollout
from lariat.rod.rod import Rod
from lariat.rod.rollout_spec import RolloutSpec
from lariat.rod.state import RodState

HOVER_CLEARANCE = 0.03
"""Height of the lowest point above the tips of the first clip before it is lowered [m]."""
STEPS_PER_WAYPOINT = 10
"""Number of steps between two waypoints."""
STEP_TIME = 0.1
"""Duration of a step [s], in which the swing of a cable decays."""
SETTLING_STEPS = 20
"""Number of steps without motion at the end."""

MAX_CORRECTIONS = 8
"""Largest number of corrections of the aims."""
CORRECTION = 1.2
"""Correction of an aim over what the rod misses; a rod goes less aside than its ends [-]."""
MISS_TOLERANCE = 1e-3
"""Distance from the middle of a clip that is not corrected [m]."""

FRICTION_ERRORS = (2.0, 0.5)
"""Factors by which the friction on supports may be wrong [-]."""
YIELD_ERRORS = (1.5, 1.0 / 1.5)
"""Factors by which the yield curvature may be wrong [-]."""


def laying(
    rod: Rod,
    stops: Sequence[RouteStop],
    grips: tuple[Pose, Pose],
    rotates: tuple[bool, bool],
    obstacles: Sequence[Obstacle],
    report: Callable[[str], None] = lambda _: None,
) -> tuple[RodState, Grips]:
    """Return a rod that hangs over a route, and the waypoints of its grips that lay it from there.

    Of the settings that are tried, the first with which the rod comes to lie in all clips whatever
    its friction and yield curvature; if there is none, those that do so most often.

    Args:
        rod: The rod.
        stops: Stops of the route.
        grips: Poses of the ends at the goal.
        rotates: Whether each end rotates.
        obstacles: Obstacles, of which the supports count.
        report: Takes in words what is done at present.

    Raises:
        ValueError: The rod is too short for the route.
    """
    clips = [stop.clip for stop in stops if stop.clip]
    best, most = None, (False, 0)
    for k, settings in enumerate(TRIED_SETTINGS):

        def report_way(text: str, way: str = f"way {k + 1} of {len(TRIED_SETTINGS)}") -> None:
            report(f"{way}: {text}")

        tried = _aimed(rod, stops, grips, rotates, obstacles, settings, report_way)
        report_way("with other friction and another bending radius")
        holds = [
            all(clip.holds(laid(each, *tried, supports).final.positions) for clip in clips)
            for each, supports in _possible(rod, obstacles)
        ]
        if best is None or (holds[0], sum(holds)) > most:
            best, most = tried, (holds[0], sum(holds))
        if all(holds):
            break
    assert best is not None
    return best


def _possible(
    rod: Rod, obstacles: Sequence[Obstacle]
) -> Iterator[tuple[Rod, Float64[np.ndarray, "m 13"] | None]]:
    """Rods and packed supports that the cable and the board may be, from the believed ones on."""
    properties = rod.properties
    yield rod, pack_supports(obstacles)
    for friction, strength in product(FRICTION_ERRORS, YIELD_ERRORS):
        stronger = replace(properties, yield_curvature=strength * properties.yield_curvature)
        rougher = [replace(o, friction=friction * o.friction) for o in obstacles]
        yield Rod(stronger, rod.node_count), pack_supports(rougher)


def _aimed(
    rod: Rod,
    stops: Sequence[RouteStop],
    grips: tuple[Pose, Pose],
    rotates: tuple[bool, bool],
    obstacles: Sequence[Obstacle],
    settings: LayingSettings,
    report: Callable[[str], None],
) -> tuple[RodState, Grips]:
    """Rod and waypoints for some settings.

    A bending rod does not come to lie where its ends point: from clip to clip outward, the ends aim
    beside a clip by as much as the rod would come down beside its middle if it had no legs.
    """
    length = rod.properties.length
    ends = np.array([grip.position for grip in grips])
    _, places = laid_chain(stops, ends, length, rod.node_count)
    first = middle_clip(stops, places, length)
    openings = [(k, stop.clip) for k, stop in enumerate(stops) if stop.clip and k != first]
    outward = sorted(openings, key=lambda opening: abs(opening[0] - first))
    aims = np.zeros((len(stops), 3))
    state, waypoints = _from_above(rod, stops, places, grips, rotates, aims, settings)
    for done, (k, clip) in enumerate(outward):
        report(f"into clip {clip.name!r}")
        legs = {later.name + leg for _, later in outward[done:] for leg in LEGS}
        open_board = pack_supports([o for o in obstacles if o.name not in legs])
        for _ in range(MAX_CORRECTIONS):
            miss = _miss(clip, laid(rod, state, waypoints, open_board).positions)
            if abs(miss) < MISS_TOLERANCE:
                break
            aims[k] -= CORRECTION * miss * clip.left
            state, waypoints = _from_above(rod, stops, places, grips, rotates, aims, settings)
    return state, waypoints


def _miss(clip: ClipOpening, positions: Float64[np.ndarray, "H n 3"]) -> float:
    """Distance to the left of its middle at which a rod comes down between a clip's tips [m]; 0 if
    it does not come to the clip."""
    for nodes in positions:
        left, up = min(clip.crossings(nodes), key=lambda at: abs(at[0]), default=(0.0, np.inf))
        if up < clip.height:
            return float(left)
    return 0.0


def _from_above(
    rod: Rod,
    stops: Sequence[RouteStop],
    places: Float64[np.ndarray, "k"],
    grips: tuple[Pose, Pose],
    rotates: tuple[bool, bool],
    aims: Float64[np.ndarray, "k 3"],
    settings: LayingSettings,
) -> tuple[RodState, Grips]:
    """Rod that hangs over the first clip, and waypoints from there."""
    length = rod.properties.length
    waypoints = laying_waypoints(stops, places, grips, length, rotates, aims, settings)
    first = stops[middle_clip(stops, places, length)].clip
    assert first is not None
    hanging = rod.rest(*waypoints.pair(0)).state
    needed = first.foot[2] + first.height + rod.properties.diameter + HOVER_CLEARANCE
    lift = np.array([0.0, 0.0, needed - np.min(hanging.positions[:, 2])])
    state = replace(hanging, positions=hanging.positions + lift)
    above = Grips(waypoints.positions[:1] + lift, waypoints.orientations[:1])
    return state, Grips.joined(above, waypoints)


def laid(
    rod: Rod, state: RodState, waypoints: Grips, obstacles: Float64[np.ndarray, "m 13"] | None
) -> Rollout:
    """Return the motion of a rod whose grips go along waypoints, and then wait.

    Args:
        rod: The rod.
        state: Rod at the first waypoint.
        obstacles: Supports, packed.
    """
    moves = waypoints.steps()
    duration = STEPS_PER_WAYPOINT * STEP_TIME
    actions = np.concatenate([moves / duration, np.zeros((1, 2, 6))])
    blocks = np.repeat(np.arange(len(moves)), STEPS_PER_WAYPOINT)
    blocks = np.concatenate([blocks, np.full(SETTLING_STEPS, len(moves))])
    spec = RolloutSpec(state, actions, STEP_TIME, block_of_step=blocks, obstacles=obstacles)
    return rod.rollout(spec)

"""Seeded obstacle scenes, each with a hidden way that the finer plant has verified.

A wall with an opening, or clutter, stands between start and goal. The hidden way leads the rope
lengthwise through the opening: one end enters, the other follows, and both turn before and behind.
A scene is kept if the plant, driven along this way, keeps the stated clearance. The planner is not
told the way.

The grippers are as thin as the rope: published scenes have none.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.grips import Grips
from lariat.geometry.obstacles import signed_distance
from lariat.geometry.swept_clearance import swept_clearance
from lariat.planning.time_parameterization import Pace, time_parameterize
from lariat.planning.tree_search.grip_motion import Chords, GripMotion
from lariat.planning.tree_search.sag import SagTable
from lariat.rod import EDGE_AXIS, Rod, RodState, RolloutSpec
from lariat.scenario import Scenario, Shape, load
from lariat.scenario.sections import End, Ends, Limits, Obstacle
from lariat.scenario.shipped import find
from lariat.simulation.plants.factory import true_properties

Family = Literal["posts", "beams", "windows", "corridors", "clutter"]
PlantModel = Literal["rod", "mujoco"]
"""Simulators of the true rope in a run."""
FAMILIES: tuple[Family, ...] = get_args(Family)
"""All families of scenes."""
GAPS = (2.0, 3.0, 4.0, 8.0)
"""Widths of the openings, in rope diameters [-]."""
BASE_SCENARIO = "three-cylinders"
"""Scenario of the rope."""
CLEARANCE = 0.002
"""Clearance that the hidden way keeps, and that a path is to keep [m]."""
MAX_SAMPLES = 12
"""Number of scenes that are sampled until the plant verifies the hidden way of one."""
TAUT_SHARE = 0.97
"""Distance of the grips while the rope passes the opening, relative to its length [-]."""
SLOPE_SHARE = 0.02
"""Distance along the rope at which its slope is measured, relative to its length [-]."""
WAYPOINT_STEP = 0.02
"""Motion of a grip between two waypoints of the hidden way [m]."""
HIDDEN_PACE = Pace(5.0, (0.2, 0.1))
"""Pace of the hidden way."""
PATH_PERIOD = 0.02
"""Time between points of the hidden way [s]."""
PLANT_SUBSTEPS, CHUNK_POINTS = 4, 100
"""Steps of the plant between two points, and points of one launch."""
SETTLING_TIME = 2.0
"""Time at rest at the end [s]."""
CLUTTER_DISTANCE = 0.06
"""Distance of clutter from the lines between the grips on the hidden way [m]."""
WALL_HALF_WIDTH = 1.0
"""Half width of a wall [m]."""
WALL_HEIGHT = 1.4
"""Height of a wall, above the workspace [m]."""


@dataclass(frozen=True)
class WayScene:
    """Scene, and what is known of its hidden way."""

    scenario: Scenario
    """Scenario of the run."""
    hidden_clearance: float
    """Least clearance of the plant along the hidden way [m]."""
    goal_nodes: Float64[np.ndarray, "n 3"]
    """Nodes of the plant at rest at the end of the hidden way [m]."""


@dataclass(frozen=True)
class _Opening:
    """Opening in a wall at y = 0."""

    obstacles: list[Obstacle]
    """Bodies around it."""
    middle: Float64[np.ndarray, "3"]
    """Its middle [m]."""
    depth: float
    """Its extent along y [m]."""
    low: bool = False
    """Whether the rope must lie level in it, for its height is as little as its width."""


def sample_scene(
    family: Family,
    number: int,
    seed: int,
    gap: float,
    stiffness_error: float = 1.0,
    plant: PlantModel = "rod",
) -> WayScene:
    """Return a scene, always the same for the same arguments; its gap is in rope diameters.

    Lariat's rod verifies the hidden way, whatever the plant of the run.
    """
    random = np.random.default_rng([seed, number, FAMILIES.index(family), round(10 * gap)])
    base = _base(f"{family}-{gap:g}-{number}", seed + number, stiffness_error)
    for _ in range(MAX_SAMPLES):
        scene = _attempt(base, family, gap, random)
        if scene is not None:
            run = replace(scene.scenario, plant=replace(base.plant, model=plant))
            return replace(scene, scenario=run)
    raise ValueError(
        f"no hidden way of {family}-{number} with a gap of {gap:g} diameters was verified in "
        f"{MAX_SAMPLES} samples; try another seed"
    )


def _base(name: str, seed: int, stiffness_error: float) -> Scenario:
    base = load(find(BASE_SCENARIO))
    rope = base.rope
    believed = rope.youngs_modulus / stiffness_error
    radius = rope.diameter / 2.0
    limits = Limits(gripper_radius=radius, gripper_height=2.0 * radius, keep_out=0.0, spacing=0.03)
    return replace(
        base,
        name=name,
        seed=seed,
        rope=replace(rope, youngs_modulus=believed),
        plant=replace(
            base.plant,
            model="rod",
            rope=replace(base.plant.rope, youngs_modulus=rope.youngs_modulus),
        ),
        ends=Ends(End(rotates=True), End(rotates=True)),
        limits=limits,
        sensing=replace(base.sensing, source="truth"),
        control=replace(base.control, clearance=CLEARANCE, adapt=stiffness_error != 1.0),
        run=replace(base.run, time_limit=25.0, tolerance=0.003),
        events=(),
    )


def _attempt(
    base: Scenario, family: Family, gap: float, random: np.random.Generator
) -> WayScene | None:
    """One sampled scene; None if the plant does not keep clear on its hidden way."""
    rope = base.rope
    opening = _OPENINGS[family](gap * rope.diameter, random)
    rod = Rod(true_properties(base), base.plant_rope.node_count)
    waypoints = _hidden_way(rod, opening, random)
    if family == "clutter":
        opening.obstacles.extend(_clutter(random, waypoints))
    named = tuple(replace(o, name=f"{o.shape}-{k}") for k, o in enumerate(opening.obstacles))
    scenario = replace(base, obstacles=named)
    path = time_parameterize(waypoints, scenario.limits, PATH_PERIOD, HIDDEN_PACE)
    clearance, nodes = drive(rod, scenario.bodies, path, PATH_PERIOD)
    if clearance < CLEARANCE:
        return None
    start, goal = (_shape(waypoints, k) for k in (0, -1))
    # The goal is the shape of the true rope: the believed one has another between the same grips.
    goal = replace(goal, nodes=nodes)
    return WayScene(replace(scenario, start=start, goal=goal), clearance, nodes)


def drive(
    rod: Rod, obstacles: Sequence[Obstacle], path: Grips, dt: float, least: float = CLEARANCE
) -> tuple[float, Float64[np.ndarray, "n 3"]]:
    """Return the clearance of the plant along a path [m], and its nodes at rest after it [m].

    Obstacles are measured, not felt. The motion ends below the least clearance.
    """
    state: RodState = rod.rest(*path.pair(0)).state
    velocities = path.steps() / dt
    settling = np.zeros((round(SETTLING_TIME / dt), 2, 6))
    velocities = np.concatenate([velocities, settling])
    radius, clearance = rod.properties.diameter / 2.0, np.inf
    for first in range(0, len(velocities), CHUNK_POINTS):
        chunk = np.repeat(velocities[first : first + CHUNK_POINTS], PLANT_SUBSTEPS, axis=0)
        rollout = rod.rollout(RolloutSpec(state, chunk, dt / PLANT_SUBSTEPS))
        nodes = np.concatenate([state.positions[None], rollout.positions])
        clearance = min(clearance, swept_clearance(nodes, radius, obstacles))
        state = rollout.final
        if clearance < least:
            break
    return clearance, state.positions


def _hidden_way(rod: Rod, opening: _Opening, random: np.random.Generator) -> Grips:
    """Waypoints: before the wall, aligned, lengthwise through the opening, and turned behind it."""
    length = rod.properties.length
    motion = GripMotion(np.ones((2, 6), dtype=bool), length / (2.0 * np.pi))
    along_x = poses.rotation_between(EDGE_AXIS, np.array([1.0, 0.0, 0.0]))
    level = Grips(np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0]]]), np.tile(along_x, (1, 2, 1)))
    sag = SagTable(rod)

    def across(y: float) -> Grips:
        yaw, share = random.uniform(-0.6, 0.6), random.uniform(0.75, 0.93)
        chord = share * length * np.array([[np.cos(yaw), np.sin(yaw), 0.0]])
        low = np.array([-0.15, y - 0.05, 0.25])
        middle = random.uniform(low, low + np.array([0.3, 0.1, 0.2]))
        return motion.placed(Chords(middle[None], chord), level)

    # The left grip follows the right one: it stays before the wall until the rope has passed.
    taut = TAUT_SHARE * length
    reach = 0.5 * (taut + opening.depth) + 0.03
    fractions = np.linspace(0.5 + reach / taut, 0.5 - reach / taut, 40)
    chords = np.tile(taut * np.array([0.0, 1.0, 0.0]), (len(fractions), 1))
    if opening.low:
        chords[:, 2] = taut * _slopes(sag, chords, fractions)
        chords = taut * poses.normalized(chords)
    middles = opening.middle - (fractions - 0.5)[:, None] * chords
    middles[:, 2] += sag.below(chords, fractions)
    passing = motion.placed(Chords(middles, chords), level[np.zeros(len(fractions), dtype=int)])
    waypoints = Grips.joined(across(-0.35), passing, across(0.35))
    parts = []
    for k in range(len(waypoints) - 1):
        one, other = waypoints[k : k + 1], waypoints[k + 1 : k + 2]
        count = max(1, int(np.ceil(motion.length(one, other)[0] / WAYPOINT_STEP)))
        parts.append(motion.between(one, other, np.arange(count)[None] / count))
    return Grips.joined(*parts, waypoints[-1:])


def _slopes(
    sag: SagTable, chords: Float64[np.ndarray, "k 3"], fractions: Float64[np.ndarray, "k"]
) -> Float64[np.ndarray, "k"]:
    """Slopes of level ropes below the line between their grips, at places along them."""
    inside = np.clip(fractions, SLOPE_SHARE, 1.0 - SLOPE_SHARE)
    deeper = sag.below(chords, inside + SLOPE_SHARE) - sag.below(chords, inside - SLOPE_SHARE)
    return deeper / (2.0 * SLOPE_SHARE * np.linalg.norm(chords, axis=1))


def _walls(x: float, z: float, width: float, height: float, depth: float) -> list[Obstacle]:
    """Boxes of a wall at y = 0 around a rectangular opening."""
    side = WALL_HALF_WIDTH
    low, high = max(z - height / 2.0, 0.0), z + height / 2.0
    boxes = []
    for left, right in ((-side, x - width / 2.0), (x + width / 2.0, side)):
        boxes.append(_box((left, right), (0.0, WALL_HEIGHT), depth))
    if low > 0.0:
        boxes.append(_box((x - width / 2.0, x + width / 2.0), (0.0, low), depth))
    if high < WALL_HEIGHT:
        boxes.append(_box((x - width / 2.0, x + width / 2.0), (high, WALL_HEIGHT), depth))
    return boxes


def _box(x: tuple[float, float], z: tuple[float, float], depth: float) -> Obstacle:
    middle = (0.5 * (x[0] + x[1]), 0.0, 0.5 * (z[0] + z[1]))
    return Obstacle("box", middle, size=(x[1] - x[0], depth, z[1] - z[0]))


def _place(random: np.random.Generator) -> tuple[float, float]:
    """Horizontal place and height of an opening [m]."""
    return float(random.uniform(-0.1, 0.1)), float(random.uniform(0.25, 0.45))


def _posts(gap: float, random: np.random.Generator) -> _Opening:
    """Two posts as high as the workspace with a gap of the stated width, and walls beside them."""
    x, z = _place(random)
    radius = float(random.uniform(0.015, 0.03))
    posts = []
    for sign in (-1.0, 1.0):
        away = gap / 2.0 + radius
        place = (x + sign * away, 0.0, WALL_HEIGHT / 2.0)
        posts.append(Obstacle("cylinder", place, radius=radius, height=WALL_HEIGHT))
        edges = sorted((x + sign * away, sign * WALL_HALF_WIDTH))
        posts.append(_box((edges[0], edges[1]), (0.0, WALL_HEIGHT), 0.01))
    return _Opening(posts, np.array([x, 0.0, z]), 2.0 * radius)


def _beams(gap: float, random: np.random.Generator) -> _Opening:
    """Beams across the workspace, one above the other, with one gap of the stated width."""
    x, z = _place(random)
    thick = float(random.uniform(0.02, 0.04))
    beams = []
    for low, high in ((0.0, z - gap / 2.0), (z + gap / 2.0, WALL_HEIGHT)):
        count = max(1, int((high - low) / 0.2))
        edges = np.linspace(low, high, count + 1)
        beams += [
            _box((-WALL_HALF_WIDTH, WALL_HALF_WIDTH), (float(a), float(b)), thick)
            for a, b in pairwise(edges)
        ]
    return _Opening(beams, np.array([x, 0.0, z]), thick, low=True)


def _windows(gap: float, random: np.random.Generator) -> _Opening:
    """A wall with a window of the stated width, and up to three times as high."""
    x, z = _place(random)
    thick = float(random.uniform(0.01, 0.03))
    height = gap * float(random.uniform(1.5, 3.0))
    return _Opening(_walls(x, z, gap, height, thick), np.array([x, 0.0, z]), thick)


def _corridors(gap: float, random: np.random.Generator) -> _Opening:
    """A corridor of the stated width between two thick walls."""
    x, z = _place(random)
    depth = float(random.uniform(0.08, 0.2))
    return _Opening(_walls(x, z, gap, 2.0 * WALL_HEIGHT, depth), np.array([x, 0.0, z]), depth)


def _clutter(random: np.random.Generator, waypoints: Grips) -> list[Obstacle]:
    """Balls, boxes and posts before and behind the wall, off the hidden way."""
    share = np.linspace(0.0, 1.0, 9)[:, None]
    left, right = waypoints.positions[:, :1], waypoints.positions[:, 1:]
    way = left + share * (right - left)
    bodies = []
    for k in range(int(random.integers(4, 8))):
        side = -1.0 if k % 2 else 1.0
        x, y, z = random.uniform((-0.4, 0.08, 0.05), (0.4, 0.5, 0.6)).tolist()
        size = float(random.uniform(0.02, 0.05))
        match k % 3:
            case 0:
                bodies.append(Obstacle("sphere", (x, side * y, z), radius=size))
            case 1:
                bodies.append(Obstacle("box", (x, side * y, z), size=(size, 2.0 * size, size)))
            case _:
                place = (x, side * y, 0.3)
                bodies.append(Obstacle("cylinder", place, radius=0.5 * size, height=0.6))
    return [o for o in bodies if signed_distance(way, o.body(0)).min() > CLUTTER_DISTANCE]


_OPENINGS: dict[Family, Callable[[float, np.random.Generator], _Opening]] = {
    "posts": _posts,
    "beams": _beams,
    "windows": _windows,
    "corridors": _corridors,
    # Clutter stands around a wide window.
    "clutter": lambda gap, random: _windows(4.0 * gap, random),
}
"""Openings by family."""


def _shape(waypoints: Grips, index: int) -> Shape:
    """Shape of the rope between the grips of a waypoint."""
    positions, orientations = waypoints.positions[index], waypoints.orientations[index]
    left, right = map(tuple, orientations.tolist())
    return Shape(
        line=tuple(map(tuple, positions.tolist())), left_orientation=left, right_orientation=right
    )

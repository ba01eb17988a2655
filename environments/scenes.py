"""Random scenes: `sample_scene` returns the scenario of a kind, a number and a seed.

Every goal is a rest shape of the true rope between grips that keep clear of all obstacles, so that
the rope can take it. Whether a path leads there is not known beforehand, except for `blocked`,
where there is none.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.geometry import polylines, poses
from lariat.geometry.grippers import gripper_points
from lariat.geometry.obstacles import chain_clearance, signed_distance
from lariat.geometry.poses import Pose
from lariat.rod import Rod
from lariat.scenario import Scenario, Shape, load
from lariat.scenario.goal_table import LEVEL_GRIP
from lariat.scenario.sections import End, Ends, Event, Obstacle, Waypoint
from lariat.scenario.shipped import find
from lariat.simulation.plants.factory import build_plant, true_properties

Kind = Literal[
    "easy",
    "hard",
    "boxes",
    "slot",
    "rotating",
    "shapes",
    "appearing",
    "moving",
    "crossing",
    "new-goal",
    "part",
    "arms",
    "blocked",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
"""All kinds of scenes."""
MIN_CLEARANCE = 0.015
"""Least clearance of rope and grippers at start and goal [m]."""
MIN_GRIP_HEIGHT = 0.03
"""Least height of a grip above the table [m]."""
MAX_SHAPE_SAMPLES = 400
"""Number of shapes sampled among given obstacles before the obstacles are sampled anew."""
MAX_SCENE_SAMPLES = 20
"""Number of times that the obstacles are sampled anew."""
ARMS_SCENARIO = "two-arms"
"""Scenario of the arms, and of how they hold the rope at the start."""
ARM_SAMPLES = 10
"""Number of goals that are sampled for the arms before the obstacles are sampled anew."""
PART_SAMPLES = 2000
"""Points of a shape from which a part is taken [-]."""
Corner = tuple[float, float, float]
"""Corner of a box [m]."""


@dataclass(frozen=True)
class HeldShape:
    """Rest shape of the rope, and the grips that hold it there."""

    left: Pose
    """Left grip."""
    right: Pose
    """Right grip."""
    nodes: Float64[np.ndarray, "n 3"]
    """Node positions [m]."""


class NoShapeFoundError(ValueError):
    """Raised when no shape was found among the obstacles of a scene."""


def sample_scene(kind: Kind, number: int, seed: int, base: Scenario) -> Scenario:
    """Return a scene, always the same for the same kind, number, seed, rope and plant.

    Raises:
        ValueError: No scene was found.
    """
    random = np.random.default_rng([seed, number])
    base = replace(base, name=f"{kind}-{number}", seed=seed + number, events=())
    for _ in range(MAX_SCENE_SAMPLES):
        try:
            return _SAMPLERS[kind](_SceneSampler(base, random))
        except NoShapeFoundError:
            continue
    raise ValueError(f"no scene of kind {kind!r} was found for number {number}; try another seed")


class _SceneSampler:
    """Sampler of the shapes of one scene, among its obstacles."""

    def __init__(self, base: Scenario, random: np.random.Generator) -> None:
        self.base, self.random = base, random
        self.rod = Rod(true_properties(base), base.rope.node_count)

    def shape(
        self, low: Corner, high: Corner, tilt: float = 0.0, half: tuple[float, float] = (0.08, 0.2)
    ) -> HeldShape:
        """Return a rest shape whose middle lies in a box.

        Args:
            low: Lowest corner of the box [m].
            high: Highest corner [m].
            tilt: Largest rotation of each grip away from the chord [rad]; 0 keeps both level.
            half: Bounds of half the distance between the grips [m].

        Raises:
            NoShapeFoundError: No rest shape keeps clear of the obstacles.
        """
        for _ in range(MAX_SHAPE_SAMPLES):
            length, yaw, slope = self.random.uniform((half[0], -0.7, -0.3), (half[1], 0.7, 0.3))
            centre = self.random.uniform(low, high)
            chord = length * np.array([np.cos(yaw), np.sin(yaw), slope])
            tilted = [LEVEL_GRIP, LEVEL_GRIP]
            if tilt:
                about = poses.multiply(poses.exponential(np.array([0.0, 0.0, yaw])), LEVEL_GRIP)
                tilts = self.random.uniform(-tilt, tilt, (2, 3))
                tilted = [poses.multiply(poses.exponential(t), about) for t in tilts]
            shape = self.held(Pose(centre - chord, tilted[0]), Pose(centre + chord, tilted[1]))
            if shape is not None:
                return shape
        raise NoShapeFoundError

    def held(self, left: Pose, right: Pose) -> HeldShape | None:
        """Return the rest shape between two grips; None where something is too near."""
        base = self.base
        if min(left.position[2], right.position[2]) < MIN_GRIP_HEIGHT:
            return None
        bodies = gripper_points(left, right, base.limits.gripper_reach)
        body = min(float(np.min(signed_distance(bodies, o))) for o in base.bodies)
        if body < base.limits.gripper_radius + MIN_CLEARANCE:
            return None
        try:
            rest = self.rod.rest(left, right)
        except ValueError:
            return None
        if not (rest.converged and rest.stable and self._is_clear(rest.state.positions)):
            return None
        # The plant is finer than the controller's rod, or of another make.
        plant = build_plant(base)
        plant.reset(left, right, rest.state.positions)
        nodes = plant.nodes
        return HeldShape(left, right, nodes) if self._is_clear(nodes) else None

    def _is_clear(self, nodes: Float64[np.ndarray, "n 3"]) -> bool:
        radius = self.base.rope.diameter / 2.0
        return chain_clearance(nodes, radius, self.base.bodies) > MIN_CLEARANCE

    def with_obstacles(self, *obstacles: Obstacle) -> _SceneSampler:
        """Return a sampler among other obstacles, with the same random numbers."""
        named = tuple(replace(o, name=o.name or f"{o.shape}-{k}") for k, o in enumerate(obstacles))
        return _SceneSampler(replace(self.base, obstacles=named), self.random)

    def by_grips(self, shape: HeldShape) -> Shape:
        """Specify a shape by its grips."""
        return Shape(
            line=(_triple(shape.left.position), _triple(shape.right.position)),
            left_orientation=_quadruple(shape.left.orientation),
            right_orientation=_quadruple(shape.right.orientation),
        )

    def by_nodes(self, shape: HeldShape, oriented: bool = False) -> Shape:
        """Specify a shape by its nodes, and its orientations if asked for."""
        if oriented:
            return replace(self.by_grips(shape), nodes=shape.nodes)
        return Shape(nodes=shape.nodes)

    def scenario(
        self, start: Shape, goal: HeldShape, oriented: bool = False, event: Event | None = None
    ) -> Scenario:
        """Return the scenario whose goal is given by the nodes of a shape."""
        events = () if event is None else (event,)
        shape = self.by_nodes(goal, oriented)
        return replace(self.base, start=start, goal=shape, events=events)


BOX_IN_FRONT: tuple[Corner, Corner] = ((-0.12, -0.32, 0.16), (0.12, -0.16, 0.38))
"""Box in front of the obstacles [m]."""
BOX_BEHIND: tuple[Corner, Corner] = ((-0.08, 0.07, 0.08), (0.08, 0.25, 0.20))
"""Box behind the obstacles [m]."""


def _easy(sampler: _SceneSampler) -> Scenario:
    goal = sampler.shape((-0.08, -0.20, 0.24), (0.08, 0.20, 0.36))
    return sampler.scenario(sampler.base.start, goal)


def _hard(sampler: _SceneSampler) -> Scenario:
    return sampler.scenario(sampler.base.start, sampler.shape(*BOX_BEHIND))


def _boxes(sampler: _SceneSampler) -> Scenario:
    sampler = sampler.with_obstacles(
        *_sample_boxes(sampler.random, int(sampler.random.integers(4, 8)))
    )
    start = sampler.shape(*BOX_IN_FRONT)
    goal = sampler.shape((-0.12, 0.05, 0.06), (0.12, 0.30, 0.22))
    return sampler.scenario(sampler.by_grips(start), goal)


def _sample_boxes(random: np.random.Generator, count: int) -> list[Obstacle]:
    """Sample boxes, two thirds of them on the table and one third above it."""
    boxes = []
    for k in range(count):
        size = random.uniform((0.04, 0.04, 0.05), (0.16, 0.12, 0.20))
        x, y = random.uniform((-0.32, -0.10), (0.32, 0.26))
        lifted = random.uniform(0.08, 0.25) if k % 3 == 2 else 0.0
        turned = poses.exponential(np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)]))
        place = (float(x), float(y), float(size[2] / 2.0 + lifted))
        boxes.append(Obstacle("box", place, orientation=_quadruple(turned), size=_triple(size)))
    return boxes


def _slot(sampler: _SceneSampler) -> Scenario:
    """A wall with a window as the only passage, or a shelf above the goal."""
    random = sampler.random
    thick = float(random.uniform(0.015, 0.04))
    if random.random() < 0.3:
        depth, height = float(random.uniform(0.15, 0.25)), float(random.uniform(0.14, 0.2))
        plate = Obstacle("box", (0.0, 0.1 + depth / 2.0, height), size=(1.0, depth, 0.02))
        sampler = sampler.with_obstacles(plate)
        goal = sampler.shape((-0.05, 0.12, 0.03), (0.05, 0.08 + depth, height - 0.02))
        return sampler.scenario(sampler.by_grips(sampler.shape(*BOX_IN_FRONT)), goal)
    wide = random.random() < 0.5
    width = float(random.uniform(0.60, 0.70) if wide else random.uniform(0.38, 0.46))
    height = float(random.uniform(0.11, 0.17) if wide else random.uniform(0.26, 0.34))
    sill = float(random.uniform(0.05, 0.15))
    side = 0.9 - width / 2.0
    top = 1.3 - sill - height
    sampler = sampler.with_obstacles(
        Obstacle("box", (0.0, 0.0, sill / 2.0), size=(1.8, thick, sill), name="sill"),
        Obstacle(
            "box", (0.0, 0.0, sill + height + top / 2.0), size=(1.8, thick, top), name="lintel"
        ),
        *(
            Obstacle(
                "box",
                (sign * (width + side) / 2.0, 0.0, sill + height / 2.0),
                size=(side, thick, height),
                name=f"jamb-{'left' if sign < 0 else 'right'}",
            )
            for sign in (-1.0, 1.0)
        ),
    )
    start = sampler.shape(*BOX_IN_FRONT)
    goal = sampler.shape((-0.10, 0.10, 0.08), (0.10, 0.30, 0.30))
    return sampler.scenario(sampler.by_grips(start), goal)


def _turning(sampler: _SceneSampler) -> tuple[_SceneSampler, HeldShape, HeldShape]:
    """Sample three cylinders, and start and goal of a rope whose ends rotate."""
    random = sampler.random
    posts = [
        Obstacle(
            "cylinder",
            (float(x), float(random.uniform(-0.03, 0.06)), h / 2.0),
            radius=float(random.uniform(0.02, 0.04)),
            height=h,
        )
        for x, h in zip((-0.13, 0.0, 0.13), random.uniform(0.08, 0.2, 3).tolist(), strict=True)
    ]
    turning = replace(sampler.base, ends=Ends(End(rotates=True), End(rotates=True)))
    sampler = _SceneSampler(turning, random).with_obstacles(*posts)
    start = sampler.shape(*BOX_IN_FRONT, tilt=0.5)
    return sampler, start, sampler.shape((-0.1, 0.08, 0.12), (0.1, 0.25, 0.28), tilt=0.9)


def _rotating(sampler: _SceneSampler) -> Scenario:
    sampler, start, goal = _turning(sampler)
    return sampler.scenario(sampler.by_grips(start), goal, oriented=True)


def _shapes(sampler: _SceneSampler) -> Scenario:
    """Start and goal given by nodes only, as in published benchmarks."""
    sampler, start, goal = _turning(sampler)
    return sampler.scenario(sampler.by_nodes(start), goal)


def _appearing(sampler: _SceneSampler) -> Scenario:
    """A box appears on the way shortly after the start."""
    return _disturbed(sampler, moves=False)


def _moving(sampler: _SceneSampler) -> Scenario:
    """A box moves onto the way shortly after the start."""
    return _disturbed(sampler, moves=True)


def _disturbed(sampler: _SceneSampler, *, moves: bool) -> Scenario:
    random = sampler.random
    time, x, y, z = random.uniform((0.4, -0.12, 0.02, 0.26), (0.9, 0.12, 0.06, 0.40))
    body = Obstacle("box", (float(x), float(y), float(z)), size=(0.08, 0.05, 0.08), name="guest")
    crowd = sampler.with_obstacles(*sampler.base.obstacles, body)
    goal = crowd.shape(*BOX_BEHIND)
    if not moves:
        event = Event(float(time), add_obstacle=body)
        return sampler.scenario(sampler.base.start, goal, event=event)
    aside = replace(body, position=(0.6, 0.4, 0.1))
    event = Event(float(time), move_obstacle="guest", position=body.position)
    aside_base = replace(sampler.base, obstacles=(*sampler.base.obstacles, aside))
    return _SceneSampler(aside_base, random).scenario(sampler.base.start, goal, event=event)


def _crossing(sampler: _SceneSampler) -> Scenario:
    """A box crosses above the cylinders, while the rope is on its way, and is known to do so."""
    random = sampler.random
    delay, speed, y, z = random.uniform((0.1, 0.25, 0.0, 0.26), (2.0, 0.45, 0.04, 0.36)).tolist()
    side = 0.65 * float(random.choice([-1.0, 1.0]))
    begin, end = (side, y, z), (-side, y, z)
    way = (Waypoint(delay, begin), Waypoint(delay + 1.3 / speed, end))
    crane = Obstacle("box", begin, size=(0.10, 0.06, 0.12), name="crane", path=way)
    sampler = sampler.with_obstacles(*sampler.base.obstacles, crane)
    return sampler.scenario(sampler.base.start, sampler.shape(*BOX_BEHIND))


def _new_goal(sampler: _SceneSampler) -> Scenario:
    """The goal changes while the rope is on its way."""
    first = sampler.shape(*BOX_BEHIND)
    second = sampler.shape((-0.08, -0.20, 0.14), (0.08, 0.25, 0.36))
    event = Event(float(sampler.random.uniform(0.5, 2.0)), goal=sampler.by_nodes(second))
    return sampler.scenario(sampler.base.start, first, event=event)


def _part(sampler: _SceneSampler) -> Scenario:
    """The goal is a third to two thirds of a shape, of a rope whose ends rotate in half of them."""
    random = sampler.random
    if random.random() < 0.5:
        sampler, start_grips, goal = _turning(sampler)
        start = sampler.by_grips(start_grips)
    else:
        start, goal = sampler.base.start, sampler.shape(*BOX_BEHIND)
    length = sampler.base.rope.length
    size = float(random.uniform(0.33, 0.67)) * length
    begin = float(random.uniform(0.0, 1.0)) * (length - size)
    dense = polylines.resample_smooth(goal.nodes, PART_SAMPLES)
    nodes = dense[polylines.within(dense, begin, begin + size)]
    scenario = sampler.scenario(start, replace(goal, nodes=nodes))
    return replace(scenario, goal=replace(scenario.goal, part=(begin, begin + size)))


def _arms(sampler: _SceneSampler) -> Scenario:
    """Two CR5s hold the rope among posts and boxes, some of which stand where links go.

    Both arms can hold start and goal; whether a way leads there is not known.
    """
    # Only a cell with arms needs Pinocchio.
    from lariat.planning.arms.arm_check import goal_fault, start_fault
    from lariat.planning.cell_problem import scenario_problem

    random = sampler.random
    cell, rotates = load(find(ARMS_SCENARIO)), bool(random.random() < 0.5)
    ends = Ends(*(replace(end, rotates=rotates) for end in (cell.ends.left, cell.ends.right)))
    sampler = _SceneSampler(replace(sampler.base, ends=ends, start=cell.start), random)
    sampler = sampler.with_obstacles(*_sample_posts(random))
    left, right = cell.grips(cell.start)
    if sampler.held(left, right) is None:
        raise NoShapeFoundError
    for _ in range(ARM_SAMPLES):
        goal = sampler.shape((-0.15, -0.15, 0.12), (0.15, 0.35, 0.40), tilt=0.5 * rotates)
        scenario = sampler.scenario(cell.start, goal, oriented=rotates)
        problem = scenario_problem(scenario)
        if start_fault(problem) is None and goal_fault(problem) is None:
            return scenario
    raise NoShapeFoundError


def _sample_posts(random: np.random.Generator) -> list[Obstacle]:
    """Sample two to five posts and boxes on the table, up to 0.55 m high."""
    bodies = []
    for _ in range(random.integers(2, 6)):
        x, y, height = random.uniform((-0.34, -0.32, 0.1), (0.34, 0.32, 0.55)).tolist()
        radius, *size = random.uniform((0.015, 0.02, 0.02), (0.045, 0.12, 0.12)).tolist()
        shape = (
            {"shape": "cylinder", "radius": radius, "height": height}
            if random.random() < 0.6
            else {"shape": "box", "size": (*size, height)}
        )
        bodies.append(Obstacle(position=(x, y, height / 2.0), **shape))
    return bodies


def _blocked(sampler: _SceneSampler) -> Scenario:
    """A wall without a window between start and goal."""
    wall = Obstacle("box", (0.0, 0.0, 0.65), size=(1.8, 0.02, 1.3), name="wall")
    sampler = sampler.with_obstacles(wall)
    start = sampler.shape((-0.1, -0.3, 0.2), (0.1, -0.2, 0.38))
    return sampler.scenario(
        sampler.by_grips(start), sampler.shape((-0.1, 0.15, 0.12), (0.1, 0.3, 0.3))
    )


_SAMPLERS: dict[Kind, Callable[[_SceneSampler], Scenario]] = {
    "easy": _easy,
    "hard": _hard,
    "boxes": _boxes,
    "slot": _slot,
    "rotating": _rotating,
    "shapes": _shapes,
    "appearing": _appearing,
    "moving": _moving,
    "crossing": _crossing,
    "new-goal": _new_goal,
    "part": _part,
    "arms": _arms,
    "blocked": _blocked,
}
"""Samplers by kind of scene."""


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z


def _quadruple(values: np.ndarray) -> tuple[float, float, float, float]:
    w, x, y, z = np.asarray(values, float).tolist()
    return w, x, y, z

"""Seeded scenes for trials: `draw` makes the scenario of a kind and a number.

Every goal is a rest shape of the true rope between grips that keep their distance from everything:
a goal that the rope cannot take measures nothing. Whether a way leads there is not known
beforehand, except in `blocked`, where none does.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.clearance import gripper_points
from lariat.geometry.obstacles import chain_clearance, signed_distance
from lariat.geometry.poses import Pose
from lariat.rod import Rod
from services.sim.plants.factory import build_plant, true_properties
from shared.scenario import Scenario, Shape
from shared.scenario.scenario import LEVEL
from shared.scenario.sections import End, Ends, Event, Obstacle

Kind = Literal[
    "easy",
    "hard",
    "boxes",
    "slot",
    "rotating",
    "shapes",
    "appearing",
    "moving",
    "new-goal",
    "blocked",
]
KINDS: tuple[Kind, ...] = get_args(Kind)
SPARE = 0.015
"""Clearance of a start and of a goal [m]."""
TRIES = 400
"""Draws of a shape among given obstacles before the obstacles are drawn anew."""
Low = tuple[float, float, float]


@dataclass(frozen=True)
class Grips:
    """A shape that the rope can take, and what holds it there."""

    left: Pose
    right: Pose
    nodes: Float64[np.ndarray, "n 3"]
    """[m]"""


class Unlucky(ValueError):
    """No shape was found among these obstacles."""


def draw(kind: Kind, number: int, seed: int, base: Scenario, folder: Path) -> Scenario:
    """A scene of a kind; the same for the same number, seed, rope and plant.

    Args:
        base: Whose rope, plant, sensing, control and run are kept.
        folder: Where the files of node lists go.
    """
    random = np.random.default_rng([seed, number])
    base = replace(base, name=f"{kind}-{number}", folder=folder, seed=seed + number, events=())
    for _ in range(20):
        try:
            return _MAKERS[kind](_Draw(base, random))
        except Unlucky:
            continue
    raise ValueError(f"no scene of kind {kind!r} was found for number {number}; try another seed")


class _Draw:
    """One scene in the making."""

    def __init__(self, base: Scenario, random: np.random.Generator) -> None:
        self.base, self.random = base, random
        self.rod = Rod(true_properties(base), base.rope.node_count)

    def shape(
        self, low: Low, high: Low, tilt: float = 0.0, half: tuple[float, float] = (0.08, 0.2)
    ) -> Grips:
        """A rest shape whose middle lies in a box.

        Args:
            low: Lowest corner of the box [m].
            high: Highest corner [m].
            tilt: Largest rotation of each grip away from the chord [rad]; 0 keeps both level.
            half: Bounds of half the distance between the grips [m].
        """
        for _ in range(TRIES):
            length, yaw, slope = self.random.uniform((half[0], -0.7, -0.3), (half[1], 0.7, 0.3))
            centre = self.random.uniform(low, high)
            chord = length * np.array([np.cos(yaw), np.sin(yaw), slope])
            held = [LEVEL, LEVEL]
            if tilt:
                about = poses.multiply(poses.exponential(np.array([0.0, 0.0, yaw])), LEVEL)
                tilts = self.random.uniform(-tilt, tilt, (2, 3))
                held = [poses.multiply(poses.exponential(t), about) for t in tilts]
            found = self._rest(Pose(centre - chord, held[0]), Pose(centre + chord, held[1]))
            if found is not None:
                return found
        raise Unlucky

    def _rest(self, left: Pose, right: Pose) -> Grips | None:
        base = self.base
        if min(left.position[2], right.position[2]) < 0.03:
            return None
        bodies = gripper_points(left, right, base.limits.gripper_reach)
        body = min(float(np.min(signed_distance(bodies, o))) for o in base.bodies)
        if body < base.limits.gripper_radius + SPARE:
            return None
        try:
            rest = self.rod.rest(left, right)
        except ValueError:
            return None
        nodes = rest.state.positions
        radius = base.rope.diameter / 2.0
        clear = chain_clearance(nodes, radius, base.bodies) > SPARE
        if not (rest.converged and rest.stable and clear):
            return None
        if base.plant.model == "mujoco":
            # The other engine's rope rests a little differently.
            plant = build_plant(base)
            plant.reset(left, right, nodes)
            nodes = plant.nodes
        return Grips(left, right, nodes)

    def among(self, *obstacles: Obstacle) -> _Draw:
        """The same among other obstacles."""
        named = tuple(replace(o, name=o.name or f"{o.shape}-{k}") for k, o in enumerate(obstacles))
        return _Draw(replace(self.base, obstacles=named), self.random)

    def by_grips(self, grips: Grips) -> Shape:
        """The rope at rest between two grips."""
        return Shape(
            line=(_triple(grips.left.position), _triple(grips.right.position)),
            left_orientation=_quadruple(grips.left.orientation),
            right_orientation=_quadruple(grips.right.orientation),
        )

    def by_nodes(self, grips: Grips, name: str, oriented: bool = False) -> Shape:
        """The nodes, as a file."""
        file = f"{self.base.name}-{name}.csv"
        np.savetxt(self.base.folder / file, grips.nodes, delimiter=",")
        shape = Shape(nodes=file)
        if oriented:
            held = self.by_grips(grips)
            shape = replace(
                shape,
                left_orientation=held.left_orientation,
                right_orientation=held.right_orientation,
            )
        return shape

    def finished(
        self, start: Shape, goal: Grips, oriented: bool = False, event: Event | None = None
    ) -> Scenario:
        """The scenario, its goal the nodes of a shape, with orientations or without."""
        events = () if event is None else (event,)
        shape = self.by_nodes(goal, "goal", oriented)
        return replace(self.base, start=start, goal=shape, events=events)


BEFORE: tuple[Low, Low] = ((-0.12, -0.32, 0.16), (0.12, -0.16, 0.38))
BEHIND: tuple[Low, Low] = ((-0.08, 0.07, 0.08), (0.08, 0.25, 0.20))


def _easy(draw: _Draw) -> Scenario:
    goal = draw.shape((-0.08, -0.20, 0.24), (0.08, 0.20, 0.36))
    return draw.finished(draw.base.start, goal)


def _hard(draw: _Draw) -> Scenario:
    return draw.finished(draw.base.start, draw.shape(*BEHIND))


def _boxes(draw: _Draw) -> Scenario:
    draw = draw.among(*_some_boxes(draw.random, int(draw.random.integers(4, 8))))
    start = draw.shape(*BEFORE)
    goal = draw.shape((-0.12, 0.05, 0.06), (0.12, 0.30, 0.22))
    return draw.finished(draw.by_grips(start), goal)


def _some_boxes(random: np.random.Generator, count: int) -> list[Obstacle]:
    """Boxes on the table, a third of them afloat."""
    boxes = []
    for k in range(count):
        size = random.uniform((0.04, 0.04, 0.05), (0.16, 0.12, 0.20))
        x, y = random.uniform((-0.32, -0.10), (0.32, 0.26))
        lifted = random.uniform(0.08, 0.25) if k % 3 == 2 else 0.0
        turned = poses.exponential(np.array([0.0, 0.0, random.uniform(-np.pi, np.pi)]))
        place = (float(x), float(y), float(size[2] / 2.0 + lifted))
        boxes.append(Obstacle("box", place, orientation=_quadruple(turned), size=_triple(size)))
    return boxes


def _slot(draw: _Draw) -> Scenario:
    """A window in a wall that nothing passes over or round, or a shelf above the goal."""
    random = draw.random
    thick = float(random.uniform(0.015, 0.04))
    if random.random() < 0.3:
        depth, height = float(random.uniform(0.15, 0.25)), float(random.uniform(0.14, 0.2))
        plate = Obstacle("box", (0.0, 0.1 + depth / 2.0, height), size=(1.0, depth, 0.02))
        draw = draw.among(plate)
        goal = draw.shape((-0.05, 0.12, 0.03), (0.05, 0.08 + depth, height - 0.02))
        return draw.finished(draw.by_grips(draw.shape(*BEFORE)), goal)
    wide = random.random() < 0.5
    width = float(random.uniform(0.60, 0.70) if wide else random.uniform(0.38, 0.46))
    height = float(random.uniform(0.11, 0.17) if wide else random.uniform(0.26, 0.34))
    sill = float(random.uniform(0.05, 0.15))
    side = 0.9 - width / 2.0
    top = 1.3 - sill - height
    draw = draw.among(
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
    start = draw.shape(*BEFORE)
    goal = draw.shape((-0.10, 0.10, 0.08), (0.10, 0.30, 0.30))
    return draw.finished(draw.by_grips(start), goal)


def _turning(draw: _Draw) -> tuple[_Draw, Grips, Grips]:
    """Both ends rotate, among a few cylinders and boxes."""
    random = draw.random
    posts = [
        Obstacle(
            "cylinder",
            (float(x), float(random.uniform(-0.03, 0.06)), h / 2.0),
            radius=float(random.uniform(0.02, 0.04)),
            height=h,
        )
        for x, h in zip((-0.13, 0.0, 0.13), random.uniform(0.08, 0.2, 3).tolist(), strict=True)
    ]
    turning = replace(draw.base, ends=Ends(End(rotates=True), End(rotates=True)))
    draw = _Draw(turning, random).among(*posts)
    start = draw.shape(*BEFORE, tilt=0.5)
    return draw, start, draw.shape((-0.1, 0.08, 0.12), (0.1, 0.25, 0.28), tilt=0.9)


def _rotating(draw: _Draw) -> Scenario:
    draw, start, goal = _turning(draw)
    return draw.finished(draw.by_grips(start), goal, oriented=True)


def _shapes(draw: _Draw) -> Scenario:
    """Start and goal as bare node lists, as benchmarks give them."""
    draw, start, goal = _turning(draw)
    return draw.finished(draw.by_nodes(start, "start"), goal)


def _appearing(draw: _Draw) -> Scenario:
    """Something comes into the way just after the run has begun."""
    return _disturbed(draw, moves=False)


def _moving(draw: _Draw) -> Scenario:
    return _disturbed(draw, moves=True)


def _disturbed(draw: _Draw, *, moves: bool) -> Scenario:
    random = draw.random
    time, x, y, z = random.uniform((0.4, -0.12, 0.02, 0.26), (0.9, 0.12, 0.06, 0.40))
    body = Obstacle("box", (float(x), float(y), float(z)), size=(0.08, 0.05, 0.08), name="guest")
    crowd = draw.among(*draw.base.obstacles, body)
    goal = crowd.shape(*BEHIND)
    if not moves:
        event = Event(float(time), add_obstacle=body)
        return draw.finished(draw.base.start, goal, event=event)
    aside = replace(body, position=(0.6, 0.4, 0.1))
    event = Event(float(time), move_obstacle="guest", position=body.position)
    aside_base = replace(draw.base, obstacles=(*draw.base.obstacles, aside))
    return _Draw(aside_base, random).finished(draw.base.start, goal, event=event)


def _new_goal(draw: _Draw) -> Scenario:
    """Another goal while the rope is on its way."""
    first = draw.shape(*BEHIND)
    second = draw.shape((-0.08, -0.20, 0.14), (0.08, 0.25, 0.36))
    event = Event(float(draw.random.uniform(0.5, 2.0)), goal=draw.by_nodes(second, "second"))
    return draw.finished(draw.base.start, first, event=event)


def _blocked(draw: _Draw) -> Scenario:
    """A wall without a window."""
    wall = Obstacle("box", (0.0, 0.0, 0.65), size=(1.8, 0.02, 1.3), name="wall")
    draw = draw.among(wall)
    start = draw.shape((-0.1, -0.3, 0.2), (0.1, -0.2, 0.38))
    return draw.finished(draw.by_grips(start), draw.shape((-0.1, 0.15, 0.12), (0.1, 0.3, 0.3)))


_MAKERS: dict[Kind, Callable[[_Draw], Scenario]] = {
    "easy": _easy,
    "hard": _hard,
    "boxes": _boxes,
    "slot": _slot,
    "rotating": _rotating,
    "shapes": _shapes,
    "appearing": _appearing,
    "moving": _moving,
    "new-goal": _new_goal,
    "blocked": _blocked,
}


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = np.asarray(values, float).tolist()
    return x, y, z


def _quadruple(values: np.ndarray) -> tuple[float, float, float, float]:
    w, x, y, z = np.asarray(values, float).tolist()
    return w, x, y, z

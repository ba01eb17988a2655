"""The lab: one rope, what surrounds it, and its time, which follows the arms."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.obstacles import Obstacle
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from services.sim.plants.plant import EndMotion, Plant, way
from shared.scenario import Scenario

LONGEST_STEP = 0.05
"""A silence of the arms is crossed in steps of at most this [s]."""
TURNS_PER_STEP = 0.02
"""How fast the start's twist is wound up."""


def true_properties(scenario: Scenario) -> RodProperties:
    """The rod that the plant really is."""
    known = {k: v for k, v in vars(scenario.plant_rope).items() if k != "node_count"}
    hidden = scenario.plant.rope
    if hidden.stiffness_profile:
        known["stiffness_profile"] = hidden.stiffness_profile
    return RodProperties(**known, rest_curvature=(hidden.rest_curvature,))


def build_plant(scenario: Scenario) -> Plant:
    """What plays the real rope in this scenario."""
    true = true_properties(scenario)
    count = scenario.plant_rope.node_count
    if scenario.plant.model == "rod":
        from services.sim.plants.rod_plant import RodPlant

        return RodPlant(true, count, scenario.bodies, scenario.plant.self_contact)
    # MuJoCo is imported only where it plays.
    from services.sim.plants.mujoco_model import RopeTruth
    from services.sim.plants.mujoco_plant import MujocoPlant

    rope = RopeTruth(
        length=true.length,
        diameter=true.diameter,
        node_count=count,
        linear_density=true.linear_density,
        youngs_modulus=true.youngs_modulus,
        poisson_ratio=true.poisson_ratio,
        damping=true.damping,
        stiffness_profile=scenario.plant.rope.stiffness_profile,
        rest_curvature=scenario.plant.rope.rest_curvature,
        friction=scenario.plant.friction,
    )
    return MujocoPlant(rope, scenario.bodies)


class World:
    """The rope between its grips; its instant is that of the last arm state that moved it."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._plant = build_plant(scenario)
        self.obstacles: tuple[Obstacle, ...] = scenario.bodies
        self.instant: int | None = None
        """What time it is in the lab [ns]; None until the first arm state."""
        self.reset()

    @property
    def nodes(self) -> Float64[np.ndarray, "n 3"]:
        """Of the true rope, left end first [m]."""
        return self._plant.nodes

    @property
    def grips(self) -> tuple[Pose, Pose]:
        """Left and right."""
        return self._ends[0].pose, self._ends[1].pose

    def reset(self) -> None:
        """Back to the scenario's start, at rest."""
        scenario = self._scenario
        left, right = scenario.grips(scenario.start)
        self._plant.reset(left, right, scenario.nodes(scenario.start))
        self._ends = (EndMotion(left), EndMotion(right))
        turns = scenario.start.turns
        count = math.ceil(abs(turns) / TURNS_PER_STEP)
        for k in range(1, count + 1):
            spin = poses.exponential(np.array([0.0, 0.0, 2.0 * math.pi * turns * k / count]))
            wound = Pose(right.position, poses.multiply(right.orientation, spin))
            self._plant.step(self._ends[0], EndMotion(wound), LONGEST_STEP)

    def set_obstacles(self, obstacles: Sequence[Obstacle]) -> None:
        """Replaces what surrounds the rope."""
        if tuple(obstacles) != self.obstacles:
            self.obstacles = tuple(obstacles)
            self._plant.set_obstacles(self.obstacles)

    def advance(self, left: EndMotion, right: EndMotion, instant: int) -> None:
        """Moves the grips there until `instant` [ns]; earlier instants are ignored."""
        if self.instant is None:
            self.instant = instant
            self._ends = (left, right)
            self._plant.step(left, right, 0.0)
            return
        duration = (instant - self.instant) / 1e9
        if duration <= 0.0:
            return
        count = math.ceil(duration / LONGEST_STEP)
        ends = (left, right)
        if count > 1:
            parts = duration / count * np.arange(1, count)
            ways = [way(a, b, duration, parts) for a, b in zip(self._ends, ends, strict=True)]
            for k in range(count - 1):
                on_the_way = (EndMotion(Pose(p[k], q[k])) for p, q in ways)
                self._plant.step(*on_the_way, duration / count)
        self._plant.step(*ends, duration / count)
        self._ends = (left, right)
        self.instant = instant

    def stand(self, instant: int) -> None:
        """Lets time pass with both grips where they are."""
        left, right = (EndMotion(pose) for pose in self.grips)
        self.advance(left, right, instant)

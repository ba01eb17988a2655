"""Combinations of a scenario with a plant, a rope and grips that the controller does not know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from lariat.scenario import SIDES, load
from lariat.scenario.shipped import shipped_names

PlantModel = Literal["rod", "mujoco", "links"]
PLANTS: tuple[PlantModel, ...] = get_args(PlantModel)
"""Simulators of the true rope."""
NODE_COUNTS = (120, 160)
"""Numbers of nodes of the true rope."""
MAX_STIFFNESS_RATIO = 4.0
"""Largest ratio of true and believed stiffness, and of believed and true stiffness [-]."""
GRIP_OFFSET = 0.003
"""Distance of each true grip from the believed one [m]."""
GRIP_ROTATION = 2.0
"""Angle of each true grip from the believed one where the end rotates [deg]."""
LENGTH_ERROR = 0.01
"""Deviation of the true length from the believed one, as a share [-]."""
ROTATING_SHARE = 0.5
"""Share of the seeded goals of an end without an arm for which it rotates [-]."""

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Combination:
    """What one run hides from the controller."""

    seed: int
    number: int
    """Number in the campaign, from 0."""
    scenario: str
    goal: Literal["shipped", "seeded"]
    """Whether the goal's grips are the scenario's, or displaced from there at random."""
    plant: PlantModel
    node_count: int
    """Number of its nodes."""
    stiffness_ratio: float
    """True stiffness, relative to the believed one [-]."""
    length_ratio: float
    """True length, relative to the believed one [-]."""
    rotates: bool
    """Whether ends without an arm rotate, beyond what the scenario says."""
    offsets: tuple[Triple, Triple]
    """Position at which the rope is held, in the frame of the left and the right grip [m]."""
    rotations: tuple[Triple, Triple]
    """Rotation vectors of the direction in which it is held [deg]."""
    adapts: bool = True

    @property
    def random(self) -> np.random.Generator:
        """Random numbers of the goal."""
        return np.random.default_rng([self.seed, self.number, 1])

    @property
    def settings(self) -> tuple[str, ...]:
        """Overrides of the shipped scenario, as for `lariat run --set`."""
        base = load(self.scenario)
        modulus = base.rope.youngs_modulus * self.stiffness_ratio
        length = (base.rope.length + base.held_length) * self.length_ratio
        settings = [
            "sensing.source=camera",
            f"control.adapt={str(self.adapts).lower()}",
            f"plant.model={self.plant}",
            f"plant.rope.node_count={self.node_count}",
            f"plant.rope.youngs_modulus={modulus!r}",
            f"plant.rope.length={length!r}",
        ]
        for side, offset, rotation in zip(SIDES, self.offsets, self.rotations, strict=True):
            settings.append(f"plant.grips.{side}.offset={list(offset)}")
            if any(rotation):
                settings.append(f"plant.grips.{side}.rotation={list(rotation)}")
            if self.rotates and base.end(side).driver == "ideal":
                settings.append(f"ends.{side}.rotates=true")
        return tuple(settings)

    def __str__(self) -> str:
        rotating = ", rotating" if self.rotates else ""
        return (
            f"{self.number}: {self.scenario}, {self.goal} goal{rotating}, {self.plant} "
            f"n = {self.node_count}, stiffness x {self.stiffness_ratio:.2f}, "
            f"length x {self.length_ratio:.2f}"
        )


def scenarios_of_one_rope() -> tuple[str, ...]:
    """Return the names of the shipped scenarios with one rope among things that stand still."""
    scenarios = {name: load(name) for name in shipped_names()}
    return tuple(
        name
        for name, scenario in scenarios.items()
        if not scenario.distractors and not scenario.obstacle_motions() and not scenario.clips
    )


def sample(
    seed: int, number: int, scenarios: tuple[str, ...] = (), adapts: bool = True
) -> Combination:
    """Return a combination, always the same for the same arguments; by default of all scenarios.

    Scenarios follow one another with the number, and plants so that each scenario meets each plant;
    everything else is drawn at random.
    """
    names = scenarios or scenarios_of_one_rope()
    random = np.random.default_rng([seed, number])
    name = names[number % len(names)]
    base = load(name)
    goal: Literal["shipped", "seeded"] = "seeded" if random.random() < 0.5 else "shipped"
    rotates = goal == "seeded" and bool(random.random() < ROTATING_SHARE)
    rotates = rotates and any(base.end(side).driver == "ideal" for side in SIDES)
    offsets = tuple(_vector(random, GRIP_OFFSET, 6) for _ in SIDES)
    rotations = [_vector(random, GRIP_ROTATION, 3) for _ in SIDES]
    for k, side in enumerate(SIDES):
        end = base.end(side)
        if not (end.rotates or (rotates and end.driver == "ideal")):
            rotations[k] = (0.0, 0.0, 0.0)
    return Combination(
        seed=seed,
        number=number,
        scenario=name,
        goal=goal,
        plant=PLANTS[(number % len(names) - number // len(names)) % len(PLANTS)],
        node_count=int(random.choice(NODE_COUNTS)),
        stiffness_ratio=round(float(MAX_STIFFNESS_RATIO ** random.uniform(-1.0, 1.0)), 3),
        length_ratio=1.0 + LENGTH_ERROR * float(random.choice([-1.0, 1.0])),
        rotates=rotates,
        offsets=(offsets[0], offsets[1]),
        rotations=(rotations[0], rotations[1]),
        adapts=adapts,
    )


def _vector(random: np.random.Generator, length: float, digits: int) -> Triple:
    """Vector of a length in any direction, evenly distributed."""
    vector = random.normal(size=3)
    x, y, z = np.round(length * (vector / np.linalg.norm(vector)), digits).tolist()
    return x, y, z

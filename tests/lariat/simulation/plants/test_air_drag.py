"""Drag of the air on the rope of every plant, towed level through still air."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope
from lariat.simulation.plants.plant import Plant
from lariat.simulation.plants.rod_plant import RodPlant

LENGTH, DIAMETER, DENSITY, MODULUS, NODES = 0.45, 0.008, 0.01, 1e5, 25
DRAG, DAMPING, SPEED = 9.9, 0.01, 1.0
ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
FORCE = 0.5 * 1.2 * DRAG * DIAMETER * SPEED**2
"""Force of the air on a rope that is towed across itself, per length [N/m]."""


def mujoco(kind: type[FlexRope] | type[LinkedRope]) -> Plant:
    rope = MujocoRope(
        LENGTH, DIAMETER, NODES, DENSITY, MODULUS, damping=DAMPING, drag_coefficient=DRAG
    )
    return MujocoPlant(kind(rope))


PLANTS: dict[str, Callable[[], Plant]] = {
    "rod": lambda: RodPlant(
        RodProperties(LENGTH, DIAMETER, DENSITY, MODULUS, damping=DAMPING, drag_coefficient=DRAG),
        NODES,
    ),
    "mujoco": lambda: mujoco(FlexRope),
    "links": lambda: mujoco(LinkedRope),
}


# The ends of a flex run ahead of its nodes by a step of the engine, 2 mm.
@pytest.mark.parametrize(("name", "within"), [("rod", 0.01), ("mujoco", 0.04), ("links", 0.01)])
def test_a_towed_rope_hangs_in_the_plane_of_weight_and_drag(name: str, within: float) -> None:
    plant = PLANTS[name]()
    grips = [np.array([x, 0.0, 0.3]) for x in (-0.215, 0.215)]
    plant.reset(*(Pose(place, ALONG_X) for place in grips))
    velocity = np.array([0.0, SPEED, 0.0])
    slopes = []
    for k in range(1, 601):
        there = (EndMotion(Pose(p + 0.01 * k * velocity, ALONG_X), velocity) for p in grips)
        plant.step(*there, 0.01)
        middle = plant.nodes[NODES // 2] - 0.01 * k * velocity - grips[0]
        slopes.append(middle[1] / middle[2])
    assert slopes[-1] == pytest.approx(FORCE / (DENSITY * 9.81), rel=within)

"""Rest shapes of all plants against the heavy elastica, a boundary value problem."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from jaxtyping import Float64

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope
from lariat.simulation.plants.plant import Plant
from lariat.simulation.plants.rod_plant import RodPlant
from tests.lariat.simulation.plants.heavy_elastica import heavy_elastica

LENGTH, DIAMETER, DENSITY = 0.45, 0.008, 0.044
"""Length [m], diameter [m] and mass per length [kg/m] of the rope."""
ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])

Build = Callable[[int, float], Plant]
PLANTS: dict[str, Build] = {
    "rod": lambda n, E: RodPlant(RodProperties(LENGTH, DIAMETER, DENSITY, E), n),
    "mujoco": lambda n, E: MujocoPlant(FlexRope(MujocoRope(LENGTH, DIAMETER, n, DENSITY, E))),
    "links": lambda n, E: MujocoPlant(LinkedRope(MujocoRope(LENGTH, DIAMETER, n, DENSITY, E))),
}
"""Plants by `plant.model`, of a node count and Young's modulus [Pa]."""


def grips(span: float, pitches: tuple[float, float]) -> tuple[Pose, Pose]:
    """Grips at a distance [m], pitched above the x axis [rad]."""
    left, right = (
        Pose(
            np.array([x, 0.0, 0.3]),
            poses.multiply(poses.exponential(np.array([0.0, -pitch, 0.0])), ALONG_X),
        )
        for x, pitch in zip((-span / 2.0, span / 2.0), pitches, strict=True)
    )
    return left, right


def errors(
    build: Build, n: int, youngs_modulus: float, span: float, pitches: tuple[float, float]
) -> Float64[np.ndarray, "n"]:
    """Distances of a plant's nodes at rest from the exact shape [m]."""
    plant = build(n, youngs_modulus)
    plant.reset(*grips(span, pitches))
    stiffness = youngs_modulus * np.pi * DIAMETER**4 / 64.0
    exact = heavy_elastica(plant.nodes, pitches, LENGTH, stiffness, DENSITY)
    return np.linalg.norm(plant.nodes - exact, axis=1)


@pytest.mark.parametrize("model", PLANTS)
def test_a_fine_plant_is_within_a_tenth_of_a_millimetre_of_the_clamped_elastica(model: str) -> None:
    found = errors(PLANTS[model], 120, 1e6, 0.24, (0.0, 0.0))
    assert np.mean(found) < 0.6e-4
    assert np.max(found) < 1e-4


@pytest.mark.parametrize("model", PLANTS)
def test_rest_shapes_between_pitched_grips_converge_in_second_order(model: str) -> None:
    coarse, fine = (np.mean(errors(PLANTS[model], n, 2e6, 0.24, (0.4, 0.3))) for n in (21, 41))
    assert np.log2(coarse / fine) > 1.6
    assert fine < 0.6e-3

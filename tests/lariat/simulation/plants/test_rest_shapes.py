"""Rest shapes of all plants against the continuum, a boundary value problem."""

from __future__ import annotations

from dataclasses import replace
from typing import Literal, get_args

import numpy as np
import pytest

from benchmarks.physics.hanging import BASE, HeldRope, level_grip
from lariat.simulation.plants.flex_rope import FlexRope
from lariat.simulation.plants.linked_rope import LinkedRope
from lariat.simulation.plants.mujoco_plant import MujocoPlant
from lariat.simulation.plants.mujoco_rope import MujocoRope
from lariat.simulation.plants.rod_plant import RodPlant

Model = Literal["rod", "mujoco", "links"]

PITCHED = replace(
    BASE.stiffer(2.0), left=level_grip(-0.12, pitch=22.9), right=level_grip(0.12, pitch=17.2)
)


def nodes_at_rest(model: Model, rope: HeldRope, node_count: int) -> np.ndarray:
    p = rope.properties
    if model == "rod":
        plant = RodPlant(p, node_count)
    else:
        sizes = p.length, p.diameter, node_count, p.linear_density
        true = MujocoRope(*sizes, p.youngs_modulus, p.poisson_ratio, p.damping)
        plant = MujocoPlant(FlexRope(true) if model == "mujoco" else LinkedRope(true))
    plant.reset(*rope.grips)
    return plant.nodes


@pytest.mark.parametrize("model", get_args(Model))
def test_a_fine_plant_is_within_a_tenth_of_a_millimetre_of_the_continuum(model: Model) -> None:
    exact = BASE.continuum.positions(120)
    distances = np.linalg.norm(nodes_at_rest(model, BASE, 120) - exact, axis=1)
    assert np.mean(distances) < 0.6e-4
    assert np.max(distances) < 1e-4


@pytest.mark.parametrize("model", get_args(Model))
def test_rest_shapes_between_pitched_grips_converge_in_second_order(model: Model) -> None:
    coarse, fine = (PITCHED.error(nodes_at_rest(model, PITCHED, n)) for n in (21, 41))
    assert np.log2(coarse / fine) > 1.6
    assert fine < 0.6

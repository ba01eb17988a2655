from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lariat.geometry import poses
from lariat.geometry.poses import Pose
from lariat.scenario import Scenario, load
from lariat.scenario.sections import TrueGrip, TrueGrips
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.factory import build_plant

LEFT_ERROR = TrueGrip((0.001, -0.002, 0.003), (2.0, 0.0, 0.0))


def held(model: str, grips: TrueGrips) -> Scenario:
    """Cell whose rope is held with given errors."""
    base = load("three-cylinders")
    coarse = replace(base.plant.rope, node_count=30)
    return replace(base, plant=replace(base.plant, model=model, grips=grips, rope=coarse))


@pytest.mark.parametrize("model", ["rod", "mujoco", "links"])
def test_the_rope_is_held_with_the_errors_of_its_grips(model: str) -> None:
    of = held(model, TrueGrips(left=LEFT_ERROR))
    left, right = of.grips(of.start)
    plant = build_plant(of)
    plant.reset(left, right)
    there = left @ Pose(np.array(LEFT_ERROR.offset), poses.IDENTITY)
    np.testing.assert_allclose(plant.nodes[[0, -1]], [there.position, right.position], atol=1e-6)
    exact = build_plant(held(model, TrueGrips()))
    exact.reset(left, right)
    slopes = [p.nodes[1] - p.nodes[0] for p in (plant, exact)]
    turned = np.degrees(np.arccos(np.prod(poses.normalized(np.array(slopes)), axis=0).sum()))
    assert turned == pytest.approx(2.0, abs=0.6)


def test_a_turning_grip_moves_the_point_that_it_holds_beside_its_axis() -> None:
    of = held("mujoco", TrueGrips(right=TrueGrip(offset=(0.003, 0.0, 0.0))))
    left, right = of.grips(of.start)
    plant = build_plant(of)
    plant.reset(left, right)
    for angle in np.linspace(0.0, np.pi / 2.0, 51)[1:]:
        spin = poses.exponential(np.array([0.0, 0.0, angle]))
        end = Pose(right.position, poses.multiply(right.orientation, spin))
        axis = poses.rotate(right.orientation, np.array([0.0, 0.0, np.pi]))
        plant.step(EndMotion(left), EndMotion(end, angular=axis), 0.01)
    quarter = right @ Pose(np.array([0.0, 0.003, 0.0]), poses.IDENTITY)
    np.testing.assert_allclose(plant.nodes[-1], quarter.position, atol=1e-6)

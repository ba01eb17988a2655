from __future__ import annotations

from dataclasses import replace

import numpy as np

from lariat.geometry import polylines, poses
from lariat.geometry.poses import Pose
from lariat.rod import RodProperties
from lariat.scenario import load
from lariat.simulation.plants.end_motion import EndMotion
from lariat.simulation.plants.factory import build_plant
from lariat.simulation.plants.rod_plant import RodPlant

ALONG_X = np.array([0.5, 0.5, 0.5, 0.5])
LEFT = Pose(np.array([-0.18, 0.0, 0.3]), ALONG_X)


def closest_approach(self_contact: bool) -> float:
    """Least distance of two strands while an end of a slack rope turns eight times [diameters]."""
    plant = RodPlant(RodProperties(0.45, 0.008, 0.044, 1e6, damping=5.0), 40, (), self_contact)
    right = Pose(np.array([0.07, 0.0, 0.3]), ALONG_X)
    plant.reset(LEFT, right)
    closest = np.inf
    for angle in np.linspace(0.0, 16.0 * np.pi, 321)[1:]:
        turn = poses.exponential(np.array([angle, 0.0, 0.0]))
        turned = Pose(right.position, poses.multiply(turn, ALONG_X))
        plant.step(EndMotion(LEFT), EndMotion(turned, angular=np.array([5.0 * np.pi, 0, 0])), 0.01)
        fine = polylines.resample(plant.nodes, 160)
        apart = np.linalg.norm(fine[:, None] - fine[None], axis=2)
        along = np.abs(np.arange(160)[:, None] - np.arange(160)[None]) * 0.45 / 159
        closest = min(closest, np.min(apart[along > 4.0 * 0.008]) / 0.008)
    return closest


def test_strands_of_a_curled_rope_touch_with_self_contact_only() -> None:
    assert closest_approach(False) < 0.7
    assert closest_approach(True) > 0.95


def lag_on_a_bar(friction: float | None) -> float:
    """Distance that a rope over a bar stays behind grips that move 20 mm along it [mm]."""
    scenario = load("over-a-bar")
    rope = replace(scenario.plant.rope, node_count=40)
    own = replace(scenario.plant, model="rod", friction=friction, rope=rope)
    plant = build_plant(replace(scenario, plant=own))
    left, right = scenario.grips(scenario.goal)
    plant.reset(left, right)
    start = plant.nodes
    for step in range(1, 101):
        moved = np.array([0.0, 0.02 * min(1.0, step / 50), 0.0])
        ends = (EndMotion(Pose(grip.position + moved, grip.orientation)) for grip in (left, right))
        plant.step(*ends, 0.02)
    return 1e3 * float(np.max(start[:, 1] + 0.02 - plant.nodes[:, 1]))


def test_friction_of_the_plant_holds_a_rope_on_its_support_where_it_is_set() -> None:
    assert lag_on_a_bar(None) < 0.3
    assert lag_on_a_bar(0.5) > 10.0


def ends_brought_together_and_back(model: str) -> tuple[np.ndarray, np.ndarray]:
    """Nodes of a cable that yields, before and after its ends were brought together."""
    scenario = load("three-cylinders")
    own = replace(scenario.plant.rope, node_count=40, damping=20.0, yield_curvature=10.0)
    plant = build_plant(
        replace(scenario, obstacles=(), plant=replace(scenario.plant, model=model, rope=own))
    )
    left, right = Pose(np.array([-0.2, 0.0, 0.4]), ALONG_X), np.array([0.2, 0.0, 0.4])
    plant.reset(left, Pose(right, ALONG_X))
    start = plant.nodes
    for k in range(1, 161):
        nearer = 0.3 * min(k / 60, 1.0, (160 - min(k, 160)) / 60) * np.array([1.0, 0.0, 0.0])
        plant.step(EndMotion(left), EndMotion(Pose(right - nearer, ALONG_X)), 0.02)
    for _ in range(40):
        plant.step(EndMotion(left), EndMotion(Pose(right, ALONG_X)), 0.02)
    return start, plant.nodes


def test_links_that_yield_keep_the_bend_of_a_rod_that_does() -> None:
    (start, rod), (_, links) = map(ends_brought_together_and_back, ("rod", "links"))
    assert np.linalg.norm(rod - start, axis=1).mean() > 4e-3
    assert np.linalg.norm(rod - links, axis=1).mean() < 1e-3

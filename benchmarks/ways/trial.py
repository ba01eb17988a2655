"""One trial: plan a path in a scene, and drive the finer plant along it."""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from benchmarks.ways.plant import drive
from benchmarks.ways.scenes import Family, WayScene, sample_scene
from lariat.geometry import polylines, poses
from lariat.rod import Rod
from services.planner.whole_path import plan
from services.sim.plants.factory import true_properties
from stack.planning import scenario_problem

MAX_TIP_ERROR = 0.010
"""Largest error of the tips at which a published trial succeeds [m]."""
MAX_TIP_ANGLE = 0.05
"""Largest angular error of the tips at which a published trial succeeds [rad]."""


@dataclass(frozen=True)
class WayTrial:
    """Finished trial; None for what was not measured."""

    family: Family
    """Family of the scene."""
    number: int
    """Number of the scene."""
    gap: float
    """Width of the opening in rope diameters [-]."""
    stiffness_error: float
    """True stiffness relative to the planner's belief [-]."""
    hidden_clearance_mm: float
    """Least clearance of the plant along the hidden way."""
    plan_s: float
    """Processor time of the plan [s]."""
    planned: bool
    """Whether the planner found a path to the goal."""
    reason: str
    """Why it did not."""
    duration_s: float
    """Duration of the path."""
    clearance_mm: float | None
    """Least clearance of the plant along the path."""
    tip_error_mm: float | None
    """Mean distance of the plant's end nodes from the goal's."""
    tip_angle: float | None
    """Mean angle between the plant's outermost edges and the goal's [rad]."""
    shape_error_mm: float | None
    """Mean node distance of the plant at rest from the goal, which is the plant's own rest shape at
    the end of the hidden way."""

    @property
    def succeeded(self) -> bool:
        """Whether both tips are where they should be and nothing was touched."""
        return (
            self.tip_error_mm is not None
            and self.tip_angle is not None
            and self.clearance_mm is not None
            and self.tip_error_mm <= 1e3 * MAX_TIP_ERROR
            and self.tip_angle <= MAX_TIP_ANGLE
            and self.clearance_mm > 0.0
        )


def run_trial(
    family: Family, number: int, seed: int, gap: float, stiffness_error: float
) -> WayTrial:
    """Sample a scene, plan in it, and drive the plant along the path.

    Raises:
        ValueError: The plant could not verify a hidden way.
    """
    scene = sample_scene(family, number, seed, gap, stiffness_error)
    problem = scenario_problem(scene.scenario)
    began = time.process_time()
    path = plan(problem)
    took = time.process_time() - began
    measured: tuple[float | None, ...] = (None, None, None, None)
    if path.reached:
        measured = _measured(scene, path.positions, path.orientations, path.dt)
    return WayTrial(
        family,
        number,
        gap,
        stiffness_error,
        1e3 * scene.hidden_clearance,
        took,
        path.reached,
        path.reason,
        len(path.positions) * path.dt,
        *measured,
    )


def _measured(
    scene: WayScene, positions: np.ndarray, orientations: np.ndarray, dt: float
) -> tuple[float, float, float, float]:
    """Clearance [mm], tip error [mm], tip angle [rad] and shape error [mm] of the plant."""
    scenario = scene.scenario
    rod = Rod(true_properties(scenario), scenario.plant_rope.node_count)
    motion = drive(rod, scenario.bodies, positions, orientations, dt)
    nodes, goal = motion.nodes, scene.goal_nodes
    tips = np.linalg.norm((nodes - goal)[[0, -1]], axis=1)
    edges = [poses.normalized(chain[[1, -1]] - chain[[0, -2]]) for chain in (nodes, goal)]
    angles = np.arccos(np.clip(np.sum(edges[0] * edges[1], axis=1), -1.0, 1.0))
    return (
        1e3 * motion.clearance,
        1e3 * float(tips.mean()),
        float(angles.mean()),
        1e3 * polylines.mean_node_distance(nodes, goal),
    )

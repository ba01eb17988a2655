"""One trial: the closed loop in a scene with a hidden way, and what the true rope did."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float64

from benchmarks.narrow.measured_services import MeasuredWorld, TimedPlanner
from benchmarks.narrow.scenes import Family, PlantModel, sample_scene
from lariat.geometry import polylines, poses
from lariat.scenario import Scenario
from services.sim.service import SimService
from shared.runtime.service import Service
from stack import services
from stack.simulation import closed_loop
from stack.simulation.simulated_time import session_id

TIME_AFTER_GOAL = 1.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""
MAX_TIP_ERROR = 10.0
"""Largest mean error of the tips at which a published trial succeeds [mm]."""
MAX_TIP_ANGLE = 0.05
"""Largest mean angular error of the tips at which a published trial succeeds [rad]."""
MAX_SHAPE_ERROR = 5.0
"""Largest mean node distance from the goal at which a trial succeeds here [mm]."""


@dataclass(frozen=True)
class WaySpec:
    """Trial to run."""

    family: Family
    """Family of the scene."""
    gap: float
    """Width of the opening in rope diameters [-]."""
    number: int
    """Number of the scene."""
    seed: int
    """Seed of the scenes."""
    stiffness_error: float
    """True stiffness relative to the belief [-]."""
    plant: PlantModel
    """Simulator of the true rope."""


@dataclass(frozen=True)
class WayTrial:
    """Finished trial."""

    spec: WaySpec
    """Scene, true stiffness and plant."""
    hidden_clearance_mm: float
    """Least clearance of the plant along the hidden way."""
    plan_s: list[float]
    """Processor time of each plan [s]."""
    run_s: float
    """Simulated duration of the run [s]."""
    clearance_mm: float
    """Least clearance of the true rope in the run, between its states too."""
    tip_error_mm: float
    """Mean distance of the true rope's end nodes from the goal's."""
    tip_angle: float
    """Mean angle between the true rope's outermost edges and the goal's [rad]."""
    shape_error_mm: float
    """Mean node distance of the true rope from the goal."""
    replans: int
    """Number of further paths that the controller requested."""
    reason: str
    """Why the run ended."""

    @property
    def misses(self) -> list[str]:
        """Reasons why the trial did not succeed, in words."""
        found = []
        if self.tip_error_mm > MAX_TIP_ERROR or self.tip_angle > MAX_TIP_ANGLE:
            found.append(f"tips {self.tip_error_mm:.1f} mm, {self.tip_angle:.3f} rad off")
        if self.shape_error_mm > MAX_SHAPE_ERROR:
            found.append(f"shape {self.shape_error_mm:.1f} mm off")
        if self.clearance_mm <= 0.0:
            found.append("touched")
        return found


def run_trial(spec: WaySpec) -> WayTrial:
    """Sample a scene and run it in closed loop.

    Raises:
        ValueError: The plant could not verify a hidden way.
    """
    scene = sample_scene(
        spec.family, spec.number, spec.seed, spec.gap, spec.stiffness_error, spec.plant
    )
    scenario = scene.scenario
    world, planner = MeasuredWorld(scenario), TimedPlanner(scenario)
    outcome = closed_loop.run(
        scenario, stop_after=TIME_AFTER_GOAL, members=_members(scenario, world, planner)
    )
    tip_error, tip_angle = tip_errors(world.nodes, scene.goal_nodes)
    return WayTrial(
        spec,
        1e3 * scene.hidden_clearance,
        planner.plan_s,
        outcome.score.sim_s,
        1e3 * world.clearance,
        1e3 * tip_error,
        tip_angle,
        1e3 * polylines.mean_node_distance(world.nodes, scene.goal_nodes),
        outcome.score.replans,
        outcome.reason,
    )


def tip_errors(
    nodes: Float64[np.ndarray, "n 3"], goal: Float64[np.ndarray, "n 3"]
) -> tuple[float, float]:
    """Return the mean error of both tips in position [m] and direction [rad].

    Args:
        nodes: Nodes of the rope [m].
        goal: Nodes of the goal [m].
    """
    apart = np.linalg.norm((nodes - goal)[[0, -1]], axis=1)
    edges = [poses.normalized(chain[[1, -1]] - chain[[0, -2]]) for chain in (nodes, goal)]
    angles = np.arccos(np.clip(np.sum(edges[0] * edges[1], axis=1), -1.0, 1.0))
    return float(apart.mean()), float(angles.mean())


def _members(
    scenario: Scenario, world: MeasuredWorld, planner: TimedPlanner
) -> tuple[Service, ...]:
    """Services of the cell, with the measuring ones in their places."""
    measuring: dict[str, Any] = {"sim": SimService(scenario, world), "planner": planner}
    return tuple(
        measuring.get(name) or services.build(name, scenario, session_id(name))
        for name in services.NAMES
    )

"""One trial: the closed loop in a scene with a hidden way, and what the true rope did."""

from __future__ import annotations

import time
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float64

from benchmarks.campaign import Trial
from benchmarks.narrow.scenes import Family, PlantModel, sample_scene
from lariat.geometry import polylines, poses
from lariat.scenario import Scenario
from services.planner.service import PlannerService
from shared import topics
from shared.messages import FAILED
from shared.runtime.service import Inbox, Publication, Service
from stack import services
from stack.simulation import closed_loop
from stack.simulation.simulated_time import session_id

TIME_AFTER_GOAL = 1.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""
MAX_TIP_ERROR, MAX_TIP_ANGLE = 10.0, 0.05
"""Largest mean error of the tips at which a published trial succeeds [mm, rad]."""
MAX_SHAPE_ERROR = 5.0
"""Largest mean node distance from the goal at which a trial succeeds here [mm]."""
MIN_PLAN_TIME = 0.02
"""Processor time of the planner's step above which it counts as a plan [s]."""


@dataclass(frozen=True)
class WaySpec:
    """Scene by family, width of the opening [rope diameters], number and seed, and its plant."""

    family: Family
    gap: float
    number: int
    seed: int
    stiffness_error: float
    """True stiffness relative to the belief [-]."""
    plant: PlantModel


def run_trial(spec: WaySpec) -> Trial:
    """Sample a scene and run it in closed loop."""
    scene = sample_scene(
        spec.family, spec.number, spec.seed, spec.gap, spec.stiffness_error, spec.plant
    )
    scenario = scene.scenario
    planner = TimedPlanner(scenario)
    members = members_with(scenario, planner)
    outcome = closed_loop.run(scenario, stop_after=TIME_AFTER_GOAL, members=members)
    if not outcome.scorer.ropes:
        raise RuntimeError(f"{scenario.name} did not start: {outcome.reason}")
    score, nodes = outcome.score, outcome.scorer.ropes[-1]
    tip_error, tip_angle = tip_errors(nodes, scene.goal_nodes)
    shape_error = polylines.mean_node_distance(nodes, scene.goal_nodes)
    task = outcome.stack.latest(topics.TASK_STATE)
    return {
        "reached": at_goal(tip_error, tip_angle, shape_error) and not score.contact_time_s,
        "gave_up": task is not None and task.state == FAILED,
        "plan_cpu_s": planner.plan_cpu_s,
        "min_clearance_mm": score.min_clearance_mm,
        "hidden_clearance_mm": 1e3 * scene.hidden_clearance,
        "tip_error_mm": 1e3 * tip_error,
        "tip_angle": tip_angle,
        "shape_error_mm": 1e3 * shape_error,
        "run_s": score.sim_s,
        "replans": score.replans,
        "reason": outcome.reason,
    }


def members_with(scenario: Scenario, planner: Service) -> tuple[Service, ...]:
    """Return the services of a cell with a planner in place of its own."""
    return tuple(
        planner if name == "planner" else services.build(name, scenario, session_id(name))
        for name in services.NAMES
    )


def at_goal(tip_error: float, tip_angle: float, shape_error: float) -> bool:
    """Return whether errors of tips [m, rad] and shape [m] are within what is asked."""
    tips = 1e3 * tip_error <= MAX_TIP_ERROR and tip_angle <= MAX_TIP_ANGLE
    return tips and 1e3 * shape_error <= MAX_SHAPE_ERROR


def tip_errors(
    nodes: Float64[np.ndarray, "n 3"], goal: Float64[np.ndarray, "n 3"]
) -> tuple[float, float]:
    """Return the mean error of both tips in position [m] and direction [rad]."""
    apart = np.linalg.norm((nodes - goal)[[0, -1]], axis=1)
    edges = [poses.normalized(chain[[1, -1]] - chain[[0, -2]]) for chain in (nodes, goal)]
    angles = np.arccos(np.clip(np.sum(edges[0] * edges[1], axis=1), -1.0, 1.0))
    return float(apart.mean()), float(angles.mean())


class TimedPlanner(PlannerService):
    """Planner that keeps the processor time of its plans."""

    def __init__(self, scenario: Scenario) -> None:
        super().__init__(scenario)
        self.plan_cpu_s: list[float] = []
        """Processor time of each plan [s]."""

    def step(self, inbox: Inbox, now: int) -> Iterator[Publication]:
        """Publish a path when one is due, and repeat the last one once a second."""
        began = time.process_time()
        published = list(super().step(inbox, now))
        took = time.process_time() - began
        if took > MIN_PLAN_TIME:
            self.plan_cpu_s.append(took)
        yield from published

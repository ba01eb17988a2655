"""One trial: the closed loop in a scene with arms, beside the path of a planner without arms."""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.arms.scenes import BASES, sample_scene
from lariat.planning.arms.arm_check import arm_fault
from lariat.planning.whole_path import plan
from lariat.scenario import load
from lariat.scenario.shipped import find
from services.planner.service import PlannerService
from shared import topics
from stack.planning import scenario_problem
from stack.simulation import closed_loop
from stack.simulation.simulated_time import Delivery

TIME_AFTER_GOAL = 1.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""
MAX_ERROR_MM = 5.0
"""Largest mean distance of true rope and goal at the end of a good run [mm]."""

ARM_RULES = frozenset(
    {"keep_out", "table", "spacing", "joint_limits", "joint_speed", "singularity", "workspace"}
)
"""Rules of the gateway that a path which the arms can go does not break."""


@dataclass(frozen=True)
class ArmSpec:
    """Trial to run."""

    arms: int
    """Number of CR5s."""
    number: int
    """Number of the scene."""
    seed: int
    """Seed of the scenes."""


@dataclass(frozen=True)
class ArmTrial:
    """Finished trial."""

    spec: ArmSpec
    """Scene."""
    plan_s: float
    """Processor time of the plan from start to goal [s]."""
    planned: bool
    """Whether that plan reaches the goal."""
    fault_without_arms: str
    """What an arm would break along the path of a planner that does not know the arms."""
    refusals: list[str]
    """Rules by which the gateway refused setpoints."""
    error_mm: float | None
    """Mean distance of the true rope from the goal at the end."""
    clearance_mm: float | None
    """Least clearance of the true rope."""
    touched: bool
    """Whether the rope touched anything."""
    replans: int
    """Number of further paths that the controller requested."""
    reason: str
    """Why the run ended."""

    @property
    def in_the_way(self) -> bool:
        """Whether the gateway refused a path because of links, joints or grippers."""
        return bool(ARM_RULES.intersection(self.refusals))

    @property
    def reached(self) -> bool:
        """Whether the rope ended at its goal and touched nothing."""
        return self.error_mm is not None and self.error_mm <= MAX_ERROR_MM and not self.touched


@dataclass
class RefusalTap:
    """Tap that collects the rules by which setpoints were refused."""

    rules: list[str] = field(default_factory=list)
    """Rules, each once."""

    def __call__(self, delivery: Delivery) -> None:
        """Take a message."""
        if delivery.topic is topics.ARM_STATE:
            rule = delivery.parse().refusal.partition(":")[0]
            if rule not in ("", *self.rules):
                self.rules.append(rule)


@cache
def _warm_up(base: str) -> None:
    """Compile the planner's kernels before anything is timed, once in a process."""
    PlannerService(load(find(base))).warm_up()


def run_trial(spec: ArmSpec) -> ArmTrial:
    """Sample a scene, plan in it with and without its arms, and run the closed loop.

    Raises:
        ValueError: No such scene was found.
    """
    _warm_up(BASES[spec.arms])
    with TemporaryDirectory() as folder:
        scenario = sample_scene(spec.arms, spec.number, spec.seed, Path(folder))
        problem = scenario_problem(scenario)
        blind = plan(replace(problem, arms=None))
        fault = arm_fault(problem, blind.positions, blind.orientations, blind.dt)
        began = time.process_time()
        path = plan(problem)
        took = time.process_time() - began
        tap = RefusalTap()
        outcome = closed_loop.run(scenario, stop_after=TIME_AFTER_GOAL, taps=(tap,))
    score = outcome.score
    return ArmTrial(
        spec,
        took,
        path.reached,
        "" if fault is None else str(fault),
        tap.rules,
        score.final_error_mm,
        score.min_clearance_mm,
        score.contact_time_s > 0.0,
        score.replans,
        outcome.reason,
    )

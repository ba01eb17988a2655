"""Trial of a campaign: a closed-loop run in a seeded scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.conditions import Conditions
from benchmarks.goals.motion_metrics import MotionMetrics
from environments.scenes import Kind, sample_scene
from lariat.scenario.settings import load_with
from shared.messages import FAILED
from stack.simulation import closed_loop
from stack.simulation.score import Score

BASE_SCENARIO = Path("three-cylinders")
"""Scenario of rope, cylinders and limits."""
PLANNING_STEP_MS = 20.0
"""Duration of the planner's step above which it counts as a planning [ms]."""


@dataclass(frozen=True)
class TrialSpec:
    """Trial to run."""

    kind: Kind
    """Kind of scene."""
    number: int
    """Number of the scene."""
    seed: int
    """Seed of the scenes."""
    settings: tuple[str, ...] = ()
    """Changes of the base scenario, as of `lariat run --set`."""
    variant: str = ""
    """Setting under comparison, in words."""


@dataclass(frozen=True)
class Trial:
    """Finished trial."""

    spec: TrialSpec
    conditions: Conditions
    score: Score
    reason: str
    """Reason why the run ended."""
    gave_up: bool
    """Whether the controller gave up."""
    plan_s: list[float]
    """Wall time of every planning [s]."""
    speed: float
    """Largest speed of a grip, relative to its limit [-]; and acceleration."""
    acceleration: float
    grip_distance: float
    """Largest distance of the grips, relative to the rope's length [-]."""
    gripper_clearance_mm: float
    """Least distance of a gripper's body from an obstacle."""
    longest_stop: float
    """Longest time for which the arms stood still on the way [s]."""
    ends: list[list[list[float]]]
    """Nodes of the true rope at the beginning and at the end [m]."""

    @property
    def touched(self) -> bool:
        """Whether the rope touched an obstacle that is not a support."""
        return self.score.contact_time_s > 0.0

    @property
    def error_mm(self) -> float:
        """Final error [mm]; infinite if the rope never moved."""
        error = self.score.final_error_mm
        return np.inf if error is None else error

    @property
    def succeeded(self) -> bool:
        """Whether nothing was touched and the goal was reached, or given up where it is blocked."""
        ended = self.gave_up if self.spec.kind == "blocked" else self.score.reached
        return ended and not self.touched


def run_trial(spec: TrialSpec) -> Trial:
    """Sample the scene and run it."""
    base = load_with(BASE_SCENARIO, spec.settings)
    scenario = sample_scene(spec.kind, spec.number, spec.seed, base)
    metrics = MotionMetrics(scenario)
    outcome = closed_loop.run(scenario, taps=(metrics,))
    step_ms = outcome.stack.step_ms("planner")
    return Trial(
        spec,
        Conditions.of(scenario),
        outcome.score,
        outcome.reason,
        gave_up=metrics.task is not None and metrics.task.state == FAILED,
        plan_s=[ms / 1e3 for ms in step_ms if ms > PLANNING_STEP_MS],
        speed=metrics.speed,
        acceleration=metrics.acceleration,
        grip_distance=metrics.grip_distance,
        gripper_clearance_mm=1e3 * metrics.gripper_clearance,
        longest_stop=metrics.longest_stop,
        ends=[nodes.tolist() for nodes in metrics.ends],
    )


def restore(score: dict[str, Any], conditions: dict[str, str], **fields: Any) -> Trial:
    """Return a trial of the fields that a file holds."""
    return Trial(score=Score(**score), conditions=Conditions(**conditions), **fields)


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """Return statistics of several trials."""
    scores = [t.score for t in trials]
    errors = [t.error_mm for t in trials]
    times = [s.reached_s for s in scores if s.reached_s is not None]
    plans = [s for t in trials for s in t.plan_s] or [np.nan]
    horizon_errors = [s.horizon_error_mm for s in scores if s.horizon_error_mm is not None]
    clearances = [s.min_clearance_mm for s in scores if s.min_clearance_mm is not None]
    figures = {
        "trials": len(trials),
        "succeeded": sum(t.succeeded for t in trials),
        **{f"error below {bound} mm": sum(e < bound for e in errors) for bound in (1, 3, 5)},
        "touched": sum(t.touched for t in trials),
        "median error [mm]": np.median(errors),
        "largest error [mm]": np.max(errors),
        "least clearance [mm]": min(clearances, default=np.nan),
        "least gripper clearance [mm]": min(t.gripper_clearance_mm for t in trials),
        "largest length error [mm]": max(s.length_error_mm for s in scores),
        "median time to goal [s]": np.median(times) if times else np.nan,
        "largest speed [of limit]": max(t.speed for t in trials),
        "largest acceleration [of limit]": max(t.acceleration for t in trials),
        "largest grip distance [of length]": max(t.grip_distance for t in trials),
        "longest stop on the way [s]": max(t.longest_stop for t in trials),
        "median horizon error [mm]": np.median(horizon_errors) if horizon_errors else np.nan,
        "median planning time [s]": np.median(plans),
        "longest planning time [s]": np.max(plans),
        "controller step p50 [ms]": np.median([s.plan_ms["p50"] for s in scores]),
        "controller step p99 [ms]": np.median([s.plan_ms["p99"] for s in scores]),
        "replans": sum(s.replans for s in scores),
    }
    return {name: round(float(value), 4) for name, value in figures.items()}

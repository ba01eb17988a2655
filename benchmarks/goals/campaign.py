"""Campaign of trials: closed-loop runs in seeded scenes, in one or several processes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np
from jaxtyping import Float64

from benchmarks.conditions import Conditions
from benchmarks.goals.motion_metrics import MotionMetrics
from environments.scenes import Kind, sample_scene
from lariat.geometry.obstacles import Obstacle
from lariat.scenario import Scenario
from shared import topics
from shared.messages import FAILED, scene_obstacles
from stack.simulation import closed_loop
from stack.simulation.closed_loop import Score

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
    base: Scenario
    """Rope, plant, sensing, control and run of the trial."""
    variant: str = ""
    """Setting under comparison, in words."""


@dataclass(frozen=True)
class Trial:
    """Finished trial."""

    variant: str
    """Setting under comparison, in words."""
    kind: Kind
    """Kind of scene."""
    number: int
    """Number of the scene."""
    conditions: Conditions
    """Plant, sensing and adaptation."""
    score: Score
    """Errors, clearance and times of the run."""
    reason: str
    """Reason why the run ended."""
    gave_up: bool
    """Whether the controller gave up."""
    plan_s: list[float]
    """Wall time of every planning [s]."""
    speed: float
    """Largest speed of a grip, relative to its limit [-]."""
    acceleration: float
    """Largest acceleration of a grip, relative to its limit [-]."""
    grip_distance: float
    """Largest distance of the grips, relative to the rope's length [-]."""
    gripper_clearance_mm: float
    """Least distance of a gripper's body from an obstacle [mm]."""
    longest_stop: float
    """Longest time for which the arms stood still on the way [s]."""
    shapes: Float64[np.ndarray, "t n 3"] = field(repr=False)
    """True rope ten times a second [m]."""
    goal: Float64[np.ndarray, "n 3"] = field(repr=False)
    """Goal at the end of the run [m]."""
    obstacles: tuple[Obstacle, ...] = field(repr=False)
    """Obstacles at the end of the run."""

    @property
    def touched(self) -> bool:
        """Whether the rope touched an obstacle that is not a support."""
        return self.score.contact_time_s > 0.0

    def error_below(self, bound_mm: float) -> bool:
        """Whether the final error is below a bound [mm]."""
        error = self.score.final_error_mm
        return error is not None and error < bound_mm

    @property
    def succeeded(self) -> bool:
        """Whether nothing was touched and the goal was reached, or given up where it is blocked."""
        if self.kind == "blocked":
            return not self.touched and self.gave_up
        return not self.touched and self.score.reached

    def as_json(self) -> dict[str, Any]:
        """Figures of the trial, without shapes and obstacles."""
        table = asdict(replace(self, shapes=np.zeros((0, 0, 3)), goal=np.zeros((0, 3))))
        for key in ("shapes", "goal", "obstacles"):
            del table[key]
        return table


def run_trial(spec: TrialSpec) -> Trial:
    """Sample the scene and run it."""
    scenario = sample_scene(spec.kind, spec.number, spec.seed, spec.base)
    metrics = MotionMetrics(scenario)
    outcome = closed_loop.run(scenario, taps=(metrics,))
    scene = outcome.stack.latest(topics.SCENE_STATE)
    task = metrics.task
    step_ms = outcome.stack.step_ms("planner")
    return Trial(
        spec.variant,
        spec.kind,
        spec.number,
        Conditions.of(scenario),
        outcome.score,
        outcome.reason,
        task is not None and task.state == FAILED,
        [ms / 1e3 for ms in step_ms if ms > PLANNING_STEP_MS],
        metrics.speed,
        metrics.acceleration,
        metrics.grip_distance,
        1e3 * metrics.gripper_clearance,
        metrics.longest_stop,
        np.array(metrics.shapes),
        np.array(task.goal.positions).reshape(-1, 3) if task else np.zeros((0, 3)),
        scenario.bodies if scene is None else scene_obstacles(scene),
    )


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """Return statistics of several trials; a trial whose rope never moved has an infinite error."""
    scores = [t.score for t in trials]
    errors = [np.inf if s.final_error_mm is None else s.final_error_mm for s in scores]
    times = [s.reached_s for s in scores if s.reached_s is not None]
    plans = [s for t in trials for s in t.plan_s] or [np.nan]
    horizon_errors = [s.horizon_error_mm for s in scores if s.horizon_error_mm is not None]
    clearances = [s.min_clearance_mm for s in scores if s.min_clearance_mm is not None]
    figures = {
        "trials": len(trials),
        "succeeded": sum(t.succeeded for t in trials),
        "error below 1 mm": sum(t.error_below(1.0) for t in trials),
        "error below 3 mm": sum(t.error_below(3.0) for t in trials),
        "error below 5 mm": sum(t.error_below(5.0) for t in trials),
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

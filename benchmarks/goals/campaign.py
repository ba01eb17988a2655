"""Runs many trials, in several processes where there are cores, and sums them up."""

from __future__ import annotations

import multiprocessing
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float64

from benchmarks.goals.motion_metrics import Executed
from benchmarks.goals.scenes import Kind, draw
from lariat.geometry.obstacles import Obstacle
from shared import topics
from shared.messages import scene_obstacles
from shared.scenario import Scenario
from stack.simulation import closed_loop
from stack.simulation.closed_loop import Score


@dataclass(frozen=True)
class Order:
    """One trial to run."""

    kind: Kind
    number: int
    seed: int
    base: Scenario
    """Rope, plant, sensing, control and run of the trial."""
    variant: str = ""
    """Which of several settings under comparison this is."""


@dataclass(frozen=True)
class Trial:
    """One trial and what came of it."""

    variant: str
    kind: Kind
    number: int
    score: Score
    reason: str
    """Why the run ended."""
    plan_s: list[float]
    """Wall time of every planning [s]."""
    speed: float
    """Most speed of a grip, as a share of the limit."""
    acceleration: float
    """The same of its acceleration."""
    apart: float
    """Most distance of the grips, as a share of the rope's length."""
    gripper_clearance_mm: float
    """Least distance of a gripper's body from an obstacle."""
    shapes: Float64[np.ndarray, "t n 3"] = field(repr=False)
    """The true rope ten times a second [m]."""
    goal: Float64[np.ndarray, "n 3"] = field(repr=False)
    obstacles: tuple[Obstacle, ...] = field(repr=False)

    @property
    def touched(self) -> bool:
        """Whether the rope met an obstacle that is no support."""
        return self.score.contact_time_s > 0.0

    def within(self, millimetres: float) -> bool:
        """Whether the final error is less."""
        error = self.score.final_error_mm
        return error is not None and error < millimetres

    @property
    def as_wanted(self) -> bool:
        """Reached, or where nothing can be reached said so; and touched nothing."""
        if self.kind == "blocked":
            return not self.touched and "gave up" in self.reason
        return not self.touched and self.score.reached

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        table = asdict(replace(self, shapes=np.zeros((0, 0, 3)), goal=np.zeros((0, 3))))
        for key in ("shapes", "goal", "obstacles"):
            del table[key]
        return table


def run(orders: Sequence[Order], workers: int, done: Callable[[Trial], None]) -> list[Trial]:
    """All trials, in their order.

    Args:
        workers: Processes; one runs them here.
        done: Called after each, in the order in which they end.
    """
    if workers <= 1:
        return list(_here(orders, done))
    # A fork would share a Taichi runtime that is not made for it.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(workers, mp_context=context) as pool:
        futures = {pool.submit(one, order): k for k, order in enumerate(orders)}
        trials: dict[int, Trial] = {}
        for future in as_completed(futures):
            trials[futures[future]] = future.result()
            done(future.result())
    return [trials[k] for k in range(len(orders))]


def _here(orders: Sequence[Order], done: Callable[[Trial], None]) -> Iterator[Trial]:
    for order in orders:
        trial = one(order)
        done(trial)
        yield trial


def one(order: Order) -> Trial:
    """Draws the scene and runs it."""
    with tempfile.TemporaryDirectory() as folder:
        scenario = draw(order.kind, order.number, order.seed, order.base, Path(folder))
        executed = Executed(scenario)
        outcome = closed_loop.run(scenario, taps=(executed,))
    scene = outcome.stack.latest(topics.SCENE_STATE)
    task = executed.task
    plans = [ms / 1e3 for ms in outcome.stack.step_ms("planner") if ms > PLANNING]
    return Trial(
        order.variant,
        order.kind,
        order.number,
        outcome.score,
        outcome.reason,
        plans,
        executed.speed,
        executed.acceleration,
        executed.apart,
        1e3 * executed.gripper_clearance,
        np.array(executed.shapes),
        np.array(task.goal.positions).reshape(-1, 3) if task else np.zeros((0, 3)),
        scenario.bodies if scene is None else scene_obstacles(scene),
    )


PLANNING = 20.0
"""A step of the planner that took longer than this has planned [ms]."""


def summary(trials: Sequence[Trial]) -> dict[str, float]:
    """What several trials together show; one without an error never moved and counts as missed."""
    scores = [t.score for t in trials]
    errors = [np.inf if s.final_error_mm is None else s.final_error_mm for s in scores]
    times = [s.reached_s for s in scores if s.reached_s is not None]
    plans = [s for t in trials for s in t.plan_s] or [np.nan]
    predictions = [s.horizon_error_mm for s in scores if s.horizon_error_mm is not None]
    clearances = [s.min_clearance_mm for s in scores if s.min_clearance_mm is not None]
    figures = {
        "trials": len(trials),
        "as wanted": sum(t.as_wanted for t in trials),
        "within 1 mm": sum(t.within(1.0) for t in trials),
        "within 3 mm": sum(t.within(3.0) for t in trials),
        "within 5 mm": sum(t.within(5.0) for t in trials),
        "touched": sum(t.touched for t in trials),
        "error median [mm]": np.median(errors),
        "error worst [mm]": np.max(errors),
        "clearance least [mm]": min(clearances, default=np.nan),
        "gripper clearance least [mm]": min(t.gripper_clearance_mm for t in trials),
        "length error worst [mm]": max(s.length_error_mm for s in scores),
        "time median [s]": np.median(times) if times else np.nan,
        "speed most [of limit]": max(t.speed for t in trials),
        "acceleration most [of limit]": max(t.acceleration for t in trials),
        "grips apart most [of length]": max(t.apart for t in trials),
        "horizon error median [mm]": np.median(predictions) if predictions else np.nan,
        "plan median [s]": np.median(plans),
        "plan longest [s]": np.max(plans),
        "step p50 [ms]": np.median([s.plan_ms["p50"] for s in scores]),
        "step p99 [ms]": np.median([s.plan_ms["p99"] for s in scores]),
        "replans": sum(s.replans for s in scores),
    }
    return {name: round(float(value), 4) for name, value in figures.items()}

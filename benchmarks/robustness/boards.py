"""A cable laid on boards whose clips are moved: `lariat bench robustness boards`.

Each board is `harness-board` with its clips moved and turned at random. The true cable is of
another make and finer than the model, is seen by the camera, and its friction and its yield
curvature are wrong in the model, in turn too large and too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.campaign import Campaign, Workers, success_interval
from benchmarks.narrow.trial import TimedPlanner
from benchmarks.robustness.combinations import PlantModel
from benchmarks.tables import Result, publish
from lariat.geometry.cable_routes import clip_names
from lariat.scenario import Scenario, load
from stack import services
from stack.simulation import closed_loop
from stack.simulation.simulated_time import session_id

BASE_SCENARIO = "harness-board"
MAX_SHIFT = 0.03
"""Largest distance by which a clip is moved in x and in y [m]."""
MAX_TURN = 20.0
"""Largest angle by which it is turned [deg]."""
TIME_AFTER_GOAL = 1.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""


@dataclass(frozen=True)
class BoardSpec:
    """Board, and what is hidden from the controller."""

    number: int
    plant: PlantModel
    node_count: int
    """Number of nodes of the true cable."""
    friction_error: float
    """True coefficient of friction relative to the model's [-]."""
    yield_error: float
    """True yield curvature relative to the model's [-]."""
    source: str
    """What is sensed."""

    @property
    def scenario(self) -> Scenario:
        """Scenario of the run, always the same for the same number."""
        base, random = load(BASE_SCENARIO), np.random.default_rng(self.number)
        clips = []
        for clip in base.clips:
            x, y = clip.position[:2] + random.uniform(-MAX_SHIFT, MAX_SHIFT, 2)
            heading = clip.heading + random.uniform(-MAX_TURN, MAX_TURN)
            clips.append(replace(clip, position=(x, y, clip.position[2]), heading=heading))
        assert base.rope.bending_radius is not None
        assert base.plant.friction is not None
        rope = replace(
            base.plant.rope,
            node_count=self.node_count,
            bending_radius=base.rope.bending_radius / self.yield_error,
        )
        friction = self.friction_error * base.plant.friction
        return replace(
            base,
            name=f"board-{self.number}",
            seed=self.number,
            clips=tuple(clips),
            plant=replace(base.plant, model=self.plant, friction=friction, rope=rope),
            sensing=replace(base.sensing, source=self.source),
        )


@dataclass(frozen=True)
class BoardTrial:
    """Finished run."""

    spec: BoardSpec
    reached: bool
    """Whether the cable is within tolerance of its goal and all clips hold it."""
    clips_held: list[str]
    error_mm: float | None
    """Mean distance of the true cable's nodes from the goal."""
    max_tension_n: float | None
    """Largest tension of the true cable; None where the plant is none of Lariat's own rods."""
    plan_cpu_s: float
    """Processor time of all plans [s]."""
    run_s: float
    """Simulated duration of the run [s]."""
    reason: str
    """Why the run ended."""


def run(
    count: int = 20,
    first: int = 100,
    plant: PlantModel = "links",
    node_count: int = 120,
    friction_error: tuple[float, ...] = (2.0, 0.5),
    yield_error: tuple[float, ...] = (1.5, 1 / 1.5),
    source: str = "camera",
    results: Path | None = None,
    workers: Workers = 1,
    json: bool = False,
    output: Path | None = None,
) -> int:
    """Lay a cable on boards whose clips are moved by up to 3 cm and turned by up to 20 degrees.

    Errors of friction and yield take turns from board to board, those of the yield every second.

    Examples:
      lariat bench robustness boards --count 60 --results boards.jsonl
      lariat bench robustness boards --first 7 --count 1 --plant rod --source truth

    Args:
        count: Number of boards.
        first: Number, and seed, of the first board.
        plant: Simulator of the true cable.
        node_count: Number of its nodes.
        friction_error: True coefficients of friction relative to the model's [-].
        yield_error: True yield curvatures relative to the model's [-].
        source: What is sensed: `camera` or `truth`.
        results: File of finished trials, one JSON object a line; trials that it holds are not run
            again.
        workers: Number of processes, or the address of a Dask scheduler.
        json: Print one JSON object instead of a table: `trials`, and the `summary`.
        output: Folder for the same as CSV.

    Returns:
        0 if the cable was laid on all boards, else 1.
    """
    specs = [
        BoardSpec(
            number,
            plant,
            node_count,
            friction_error[number % len(friction_error)],
            yield_error[number // 2 % len(yield_error)],
            source,
        )
        for number in range(first, first + count)
    ]
    trials = Campaign(run_trial, BoardTrial, _line).trials(specs, results, workers)
    conditions = f"plant {plant}, n = {node_count}; {source}; not adapting; plan: processor time"
    tables = [Result("trials", trials, conditions), Result("summary", [summary(trials, count)])]
    publish(tables, json, output)
    return 0 if sum(trial.reached for trial in trials) == count else 1


def run_trial(spec: BoardSpec) -> BoardTrial:
    """Lay a cable on a board."""
    scenario = spec.scenario
    planner = TimedPlanner(scenario)
    members: tuple[Any, ...] = tuple(
        planner if name == "planner" else services.build(name, scenario, session_id(name))
        for name in services.NAMES
    )
    outcome = closed_loop.run(scenario, stop_after=TIME_AFTER_GOAL, members=members)
    score = outcome.score
    return BoardTrial(
        spec,
        reached=score.reached and score.clips_held == clip_names(scenario.goal.route),
        clips_held=score.clips_held or [],
        error_mm=score.final_error_mm,
        max_tension_n=score.max_tension_n,
        plan_cpu_s=sum(planner.plan_cpu_s),
        run_s=score.sim_s,
        reason=outcome.reason,
    )


def summary(trials: Sequence[BoardTrial], count: int) -> dict[str, object]:
    """Return the row of all boards.

    Args:
        trials: Finished runs.
        count: Number of boards, with those that are no valid scenarios.
    """
    good = [t for t in trials if t.reached]
    errors = [t.error_mm for t in good if t.error_mm is not None]
    return {
        "boards": count,
        "reached": len(good),
        "rate_95": list(success_interval(len(good), count)),
        "all_clips_held": sum(len(t.clips_held) == 3 for t in trials),
        "refused": count - sum(t.run_s > 0.0 for t in trials),
        "error_mm": [float(np.median(errors)), max(errors)] if errors else None,
        "plan_p50_s": float(np.median([t.plan_cpu_s for t in trials])),
    }


def _line(trial: BoardTrial) -> str:
    spec = trial.spec
    error = "-" if trial.error_mm is None else f"{trial.error_mm:.2f}"
    held = ", ".join(trial.clips_held) or "none"
    return (
        f"board {spec.number}, {spec.plant} n = {spec.node_count}, friction x "
        f"{spec.friction_error:g}, yield x {spec.yield_error:.2f}: "
        f"{'reached' if trial.reached else 'missed'}, held: {held}, {error} mm off, "
        f"plans {trial.plan_cpu_s:.1f} s of processor time; {trial.run_s:.1f} s, "
        f"{trial.reason}"
    )

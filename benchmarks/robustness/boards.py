"""A cable laid on boards whose clips are moved: `lariat bench robustness boards`.

Each board is `harness-board` with its clips moved and turned at random. The true cable is of
another make and finer than the model, is seen by the camera, and its friction and its yield
curvature are wrong in the model, in turn too large and too small.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.campaign import CAMPAIGN_DEFAULTS, CampaignOptions, Trial, success_interval
from benchmarks.narrow.trial import TIME_AFTER_GOAL, TimedPlanner, members_with
from benchmarks.robustness.combinations import PlantModel
from benchmarks.tables import Flat, Result
from lariat.geometry.cable_routes import clip_names
from lariat.scenario import Scenario, load
from stack.simulation import closed_loop

MAX_SHIFT, MAX_TURN = 0.03, 20.0
"""Largest distance by which a clip is moved in x and in y [m], and angle by which it is turned
[deg]."""


@dataclass(frozen=True)
class BoardSpec:
    """Board, and what is hidden from the controller: the true cable, relative to the model's."""

    number: int
    plant: PlantModel
    node_count: int
    friction_error: float
    yield_error: float
    source: str
    """What is sensed."""

    @property
    def scenario(self) -> Scenario:
        """Scenario of the run, always the same for the same number."""
        base, random = load("harness-board"), np.random.default_rng(self.number)
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


def run(
    count: int = 20,
    first: int = 100,
    plant: PlantModel = "links",
    node_count: int = 120,
    friction_error: tuple[float, ...] = (2.0, 0.5),
    yield_error: tuple[float, ...] = (1.5, 1 / 1.5),
    source: str = "camera",
    options: Flat[CampaignOptions] = CAMPAIGN_DEFAULTS,
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
    trials = options.trials(run_trial, specs)
    conditions = f"plant {plant}, n = {node_count}; {source}; not adapting; plan: processor time"
    options.publish(
        Result("trials", trials, conditions), Result("summary", [_summary(trials, count)])
    )
    return 0 if sum(trial["reached"] for trial in trials) == count else 1


def run_trial(spec: BoardSpec) -> Trial:
    """Lay a cable on a board: within tolerance of its goal, and held by all clips."""
    scenario = spec.scenario
    planner = TimedPlanner(scenario)
    members = members_with(scenario, planner)
    outcome = closed_loop.run(scenario, stop_after=TIME_AFTER_GOAL, members=members)
    score = outcome.score
    return {
        "reached": score.reached and score.clips_held == clip_names(scenario.goal.route),
        "clips_held": score.clips_held or [],
        "error_mm": score.final_error_mm,
        "max_tension_n": score.max_tension_n,
        "plan_cpu_s": sum(planner.plan_cpu_s),
        "run_s": score.sim_s,
        "reason": outcome.reason,
    }


def _summary(trials: Sequence[Trial], count: int) -> dict[str, object]:
    """Return the row of a number of boards, with those that are no valid scenarios."""
    good = [t for t in trials if t["reached"]]
    errors = [t["error_mm"] for t in good if t["error_mm"] is not None]
    return {
        "boards": count,
        "reached": len(good),
        "rate_95": list(success_interval(len(good), count)),
        "all_clips_held": sum(len(t["clips_held"]) == 3 for t in trials),
        "refused": count - sum(t["run_s"] > 0.0 for t in trials),
        "error_mm": [float(np.median(errors)), max(errors)] if errors else None,
        "plan_p50_s": float(np.median([t["plan_cpu_s"] for t in trials])),
    }

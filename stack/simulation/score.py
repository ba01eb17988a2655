"""Score of a run."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from stack.simulation.scoring import Scorer


@dataclass(frozen=True)
class Score:
    """Score of a run, as `lariat run --json` prints it; None for what cannot be measured."""

    scenario: str
    """Name of the scenario."""
    reached: bool
    """Whether the final error is within tolerance."""
    reached_s: float | None
    """Time from the start of the run until the rope was within tolerance for good."""
    final_error_mm: float | None
    """Mean node distance between true rope and goal, averaged over the last 0.2 s."""
    max_node_error_mm: float | None
    """Largest node distance between true rope and goal, averaged over the last 0.2 s."""
    final_angle_rad: float | None
    """Angle of the true rope's ends from a goal of them alone, averaged over the last 0.2 s."""
    final_shape_error_mm: float | None
    """Mean distance of the goal's nodes from the curve of the true rope at the end: without what
    the rope is shifted along itself."""
    min_clearance_mm: float | None
    """Least distance between the surfaces of rope and obstacles."""
    certain_clearance_mm: float | None
    """Clearance that the last path keeps with a probability of 99 %, as it was planned; None
    without `control.certain_clearance`."""
    min_distractor_clearance_mm: float | None
    """Least distance between the surfaces of rope and distractors, through which it passes."""
    clips_held: list[str] | None
    """Clips of the goal's route that hold the true rope at the end; None without a route."""
    max_tension_n: float | None
    """Largest tension of the true rope; None without `[limits] tension`."""
    contact_time_s: float
    """Time during which the rope touches obstacles."""
    length_error_mm: float
    """Largest deviation of the true rope's length from its length at rest."""
    sim_s: float
    """Simulated duration of the run."""
    wall_s: float
    """Wall time of the run."""
    real_time_factor: float
    """Simulated duration divided by wall time."""
    plan_ms: dict[str, float]
    """Wall time of the controller's steps: p50, p99, max."""
    replans: int
    """Number of new paths that the controller requested."""
    parameters: dict[str, list[float]]
    """Value and standard deviation of each estimated parameter by name."""
    prediction_error_mm: float | None
    """Mean node distance between prediction and observation, which includes the sensor noise."""
    horizon_error_mm: float | None
    """Root mean square node distance between true rope and ends of horizons, while it moved."""
    sensing_error_mm: float | None
    """Root mean square node distance between true and perceived rope, while it moved."""
    recording: str | None
    """File of the recording."""


def score_of(
    scenario: Scenario, scorer: Scorer, wall: float, step_ms: list[float], record: Path | None
) -> Score:
    """Return the score of a run that a scorer has followed.

    Args:
        scenario: Scenario of the run.
        scorer: Tap that has followed it.
        wall: Wall time that it took [s].
        step_ms: Wall times of the controller's steps [ms].
        record: Its recording.
    """
    mean, largest = scorer.final
    seconds = max(scorer.ended - scorer.started, 0) / SECOND
    quantiles = np.quantile(step_ms, [0.5, 0.99, 1.0]) if step_ms else np.zeros(3)
    predictions = scorer.prediction_errors
    reached = scorer.reached_after
    horizon, sensing = scorer.horizon_error.error, scorer.sensing_error.error
    return Score(
        scenario=scenario.name,
        reached=reached is not None,
        reached_s=None if reached is None else round(reached, 3),
        final_error_mm=_mm(mean),
        max_node_error_mm=_mm(largest),
        final_angle_rad=None if scorer.final_angle is None else round(scorer.final_angle, 5),
        final_shape_error_mm=_mm(scorer.final_shape_error),
        min_clearance_mm=_mm(scorer.min_clearance),
        certain_clearance_mm=_mm(scorer.certain_clearance),
        min_distractor_clearance_mm=_mm(scorer.min_distractor_clearance),
        clips_held=scorer.clips_held,
        max_tension_n=round(scorer.max_tension, 4) or None,
        contact_time_s=round(scorer.contact_time, 3),
        length_error_mm=round(1e3 * scorer.length_error, 4),
        sim_s=round(seconds, 3),
        wall_s=round(wall, 3),
        real_time_factor=round(seconds / wall, 3) if wall > 0.0 else 0.0,
        plan_ms=dict(zip(("p50", "p99", "max"), quantiles.round(3).tolist(), strict=True)),
        replans=scorer.replans,
        parameters=scorer.parameters,
        prediction_error_mm=_mm(float(np.mean(predictions))) if predictions else None,
        horizon_error_mm=None if horizon is None else _mm(horizon),
        sensing_error_mm=None if sensing is None else _mm(sensing),
        recording=str(record) if record else None,
    )


def _mm(meters: float) -> float | None:
    return round(1e3 * meters, 4) if np.isfinite(meters) else None


def as_json(score: Score) -> dict[str, Any]:
    """Return the score as a JSON object."""
    return asdict(score)

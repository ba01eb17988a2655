"""Error of the horizons' predictions in closed loop, against a rope finer than the model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from benchmarks.conditions import Conditions
from stack.scenario_overrides import load_with
from stack.simulation import closed_loop

MAX_NOISE_RATIO = 2.0
"""Largest ratio of prediction error and noise of a good horizon [-]."""


@dataclass(frozen=True)
class HorizonErrors:
    """Errors of the horizons of one run, while the rope moved."""

    scenario: str
    """Name of the scenario."""
    conditions: Conditions
    """Plant, sensing and adaptation."""
    prediction_mm: float
    """Root mean square node distance of the true rope from the ends of the horizons."""
    noise_mm: float
    """Root mean square node distance of the true rope from the perceived one."""

    @property
    def ratio(self) -> float:
        """Prediction error in units of the noise [-]."""
        return self.prediction_mm / self.noise_mm


def horizon_errors(name: str, plant: Literal["rod", "mujoco", "links"] | None) -> HorizonErrors:
    """Run a scenario with the camera and measure its horizons.

    Args:
        name: Name of a shipped scenario.
        plant: Simulator of the true rope; by default the scenario's.

    Raises:
        ValueError: The rope did not move.
    """
    settings = ["sensing.source=camera", *([f"plant.model={plant}"] if plant else [])]
    scenario = load_with(Path(name), settings)
    score = closed_loop.run(scenario).score
    if score.horizon_error_mm is None or score.sensing_error_mm is None:
        raise ValueError(f"the rope of {name} did not move; `lariat run {name}` says why")
    conditions = Conditions.of(scenario)
    return HorizonErrors(name, conditions, score.horizon_error_mm, score.sensing_error_mm)

"""One run of a combination, and its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.paper.horizon.errors import MAX_NOISE_RATIO
from benchmarks.robustness.combinations import Combination
from benchmarks.robustness.observability import bounds
from benchmarks.robustness.scene import build_scene
from lariat.configuration import ConfigurationError
from lariat.geometry.obstacles import chain_clearance
from lariat.scenario import Scenario
from lariat.simulation.plants.factory import true_properties
from shared import topics
from shared.messages import FAILED
from shared.version import commit
from stack.simulation import closed_loop

TIME_AFTER_GOAL = 3.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""
MAX_ERROR = 1.0
"""Largest mean distance of true rope and goal at the end of a good run [mm]."""
MAX_ERROR_ON_SUPPORT = 2.0
"""The same where the rope leans on a support, whose friction the model lacks [mm]."""
MAX_STIFFNESS_ERROR = 0.1
"""Largest relative error of a good stiffness [-]."""
TOLD_DEVIATION = 0.05
"""Least standard deviation that the shapes admit, up to which they tell the stiffness [-]."""


@dataclass(frozen=True)
class Trial:
    """Finished run."""

    spec: Combination
    """The combination."""
    commit: str
    """Commit of the code that ran."""
    score: dict[str, Any]
    """Score of the run."""
    reason: str
    """Why the run ended."""
    stopped: bool
    """Whether the controller gave up, with that reason."""
    leans: bool
    """Whether a support is in the scene."""
    goal_clearance_mm: float
    """Distance of the goal from the nearest obstacle that is no support."""
    true_stiffness: float
    """Bending stiffness of the true rope, averaged along it [N m^2]."""
    stiffness_bound: float
    """Least relative standard deviation of the stiffness that start and goal admit [-]."""
    place_bound_mm: float
    """Least standard deviation of the nodes along the rope that they admit [mm]."""

    @property
    def number(self) -> int:
        """Number of the combination."""
        return self.spec.number

    @property
    def error_mm(self) -> float:
        """Final error; infinite if the run did not start [mm]."""
        error = self.score["final_error_mm"]
        return np.inf if error is None else error

    @property
    def shape_error_mm(self) -> float:
        """Final distance of goal and rope as curves; NaN if the run did not start [mm]."""
        error = self.score.get("final_shape_error_mm")
        return np.nan if error is None else error

    @property
    def near(self) -> bool:
        """Whether the rope ended at its goal."""
        return self.error_mm <= (MAX_ERROR_ON_SUPPORT if self.leans else MAX_ERROR)

    @property
    def touched(self) -> bool:
        """Whether the rope touched an obstacle that is no support."""
        return self.score["contact_time_s"] > 0.0

    @property
    def stiffness(self) -> tuple[float, float]:
        """Estimated bending stiffness and its standard deviation, as shares of the true one."""
        value, deviation = self.score["parameters"].get("bending_stiffness", (np.nan, np.nan))
        return value / self.true_stiffness, deviation / self.true_stiffness

    @property
    def told(self) -> bool:
        """Whether the shapes tell the stiffness."""
        return self.stiffness_bound <= TOLD_DEVIATION

    @property
    def stiffness_found(self) -> bool:
        """Whether the stiffness is good."""
        return abs(self.stiffness[0] - 1.0) <= MAX_STIFFNESS_ERROR

    @property
    def noise_ratio(self) -> float:
        """Prediction error of the horizons in units of the noise [-]."""
        error, noise = self.score["horizon_error_mm"], self.score["sensing_error_mm"]
        return error / noise if error is not None and noise else np.nan

    @property
    def foresees(self) -> bool:
        """Whether horizons are right to twice the noise."""
        return self.noise_ratio <= MAX_NOISE_RATIO

    @property
    def faults(self) -> list[str]:
        """What keeps the run from being good, in words."""
        faults = []
        adapts = self.spec.adapts
        # Without adaptation a run may fail, as long as it says so.
        if not self.near and (adapts or not self.stopped):
            faults.append(f"{self.error_mm:.2f} mm off")
        if self.touched:
            faults.append("touched")
        if adapts and self.told and not self.stiffness_found:
            faults.append(f"stiffness {self.stiffness[0]:.2f} of the true one")
        return faults


def run_trial(folder: Path, combination: Combination) -> Trial:
    """Run a combination, whose scenario and goal are kept below a folder.

    Raises:
        ConfigurationError: The combination has no goal that keeps clear of the obstacles.
    """
    adapts = "" if combination.adapts else "-no-adapt"
    name = f"{combination.seed}-{combination.number}{adapts}"
    try:
        scenario = build_scene(combination, folder / name)
    except ConfigurationError as error:
        raise ConfigurationError(f"{combination}: cannot be run: {error}") from None
    outcome = closed_loop.run(scenario, stop_after=TIME_AFTER_GOAL)
    ended = outcome.stack.latest(topics.TASK_STATE)
    properties, least = true_properties(scenario), bounds(scenario)
    profile = np.mean(properties.stiffness_profile)
    return Trial(
        combination,
        commit(),
        closed_loop.as_json(outcome.score),
        outcome.reason,
        ended is not None and ended.state == FAILED,
        any(body.support for body in scenario.bodies),
        1e3 * _clearance(scenario),
        properties.bending_stiffness * float(profile),
        least.stiffness,
        1e3 * least.place,
    )


def _clearance(scenario: Scenario) -> float:
    nodes = scenario.nodes(scenario.goal)
    assert nodes is not None
    solids = [body for body in scenario.bodies if not body.support]
    return chain_clearance(nodes, scenario.plant_rope.diameter / 2.0, solids)

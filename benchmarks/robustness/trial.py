"""One run of a combination, and its verdict."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.robustness.combinations import Combination
from benchmarks.robustness.observability import bounds
from benchmarks.robustness.scene import build_scene
from lariat.configuration import ConfigurationError
from lariat.simulation.plants.factory import true_properties
from shared import topics
from shared.messages import FAILED
from shared.version import commit
from stack.simulation import closed_loop

TIME_AFTER_GOAL = 3.0
"""Time for which a run goes on after the controller says that the goal is reached [s]."""
MAX_ERROR, MAX_ERROR_ON_SUPPORT = 1.0, 2.0
"""Largest mean distance of true rope and goal at the end of a good run [mm], and the same where the
rope leans on a support, whose friction the model lacks."""
MAX_STIFFNESS_ERROR = 0.1
"""Largest relative error of a good stiffness [-]."""
OBSERVABLE_DEVIATION = 0.05
"""Least standard deviation that the shapes admit, up to which they determine the stiffness [-]."""


@dataclass(frozen=True)
class Trial:
    """Finished run."""

    spec: Combination
    commit: str
    """Commit of the code that ran."""
    error_mm: float
    """Final mean distance of true rope and goal; infinite if the run did not start."""
    shape_error_mm: float
    """Final distance of goal and rope as curves; NaN if the run did not start."""
    min_clearance_mm: float | None
    touched: bool
    """Whether the rope touched an obstacle that is no support."""
    gave_up: bool
    """Whether the controller gave up."""
    leans: bool
    """Whether a support is in the scene."""
    stiffness: float
    """Estimated bending stiffness, as a share of the true one [-]."""
    stiffness_deviation: float
    """Its stated standard deviation, as such a share [-]."""
    stiffness_bound: float
    """Least relative standard deviation of the stiffness that start and goal admit [-]."""
    place_bound_mm: float
    """Least standard deviation of the nodes along the rope that they admit."""
    noise_ratio: float
    """Prediction error of the horizons in units of the noise [-]."""
    reason: str
    """Why the run ended."""

    @property
    def near(self) -> bool:
        """Whether the rope ended at its goal."""
        return self.error_mm <= (MAX_ERROR_ON_SUPPORT if self.leans else MAX_ERROR)

    @property
    def observable(self) -> bool:
        """Whether the shapes determine the stiffness."""
        return self.stiffness_bound <= OBSERVABLE_DEVIATION

    @property
    def stiffness_is_good(self) -> bool:
        """Whether the estimated stiffness is."""
        return abs(self.stiffness - 1.0) <= MAX_STIFFNESS_ERROR

    @property
    def faults(self) -> list[str]:
        """What keeps the run from being good, in words."""
        faults = []
        adapts = self.spec.adapts
        # Without adaptation a run may fail, as long as it says so.
        if not self.near and (adapts or not self.gave_up):
            faults.append(f"{self.error_mm:.2f} mm off")
        if self.touched:
            faults.append("touched")
        if adapts and self.observable and not self.stiffness_is_good:
            faults.append(f"stiffness {self.stiffness:.2f} of the true one")
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
    score, ended = outcome.score, outcome.stack.latest(topics.TASK_STATE)
    properties, least = true_properties(scenario), bounds(scenario)
    true_stiffness = properties.bending_stiffness * float(np.mean(properties.stiffness_profile))
    value, deviation = score.parameters.get("bending_stiffness", (np.nan, np.nan))
    error, noise = score.horizon_error_mm, score.sensing_error_mm
    shape_error = score.final_shape_error_mm
    return Trial(
        combination,
        commit(),
        error_mm=np.inf if score.final_error_mm is None else score.final_error_mm,
        shape_error_mm=np.nan if shape_error is None else shape_error,
        min_clearance_mm=score.min_clearance_mm,
        touched=score.contact_time_s > 0.0,
        gave_up=ended is not None and ended.state == FAILED,
        leans=any(body.support for body in scenario.bodies),
        stiffness=value / true_stiffness,
        stiffness_deviation=deviation / true_stiffness,
        stiffness_bound=least.stiffness,
        place_bound_mm=1e3 * least.place,
        noise_ratio=error / noise if error is not None and noise else np.nan,
        reason=outcome.reason,
    )

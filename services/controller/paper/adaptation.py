"""Online adaptation of the paper, eq. (15): theta follows what a horizon has shown, by Adam.

After a horizon the same actions are rolled out once more from where it began, and all five
parameters are moved to reduce the distance of its last shape from the observed one, as many times
as the horizon was optimized. Interpretation: the norm is the sum of node distances, as in (12); m,
I and beta_b move by their logarithms, so that none becomes negative; Adam keeps its moments from
horizon to horizon. Scaling m, I and 1 / beta_b together leaves every motion as it is: only their
ratios can be found.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from jaxtyping import Bool, Float64

from lariat.rod import RodState, RolloutSpec
from lariat.rod.xpbd import PARAMETERS, XpbdProperties, XpbdRod
from services.controller.estimation.adaptation import ParameterEstimate
from services.controller.estimation.state_estimator import StateEstimator
from services.controller.paper.policies import Adam
from shared.scenario.sections import PaperControl

ADAM_RATE = 2e-3
"""Learning rate of Adam on logarithms and damping [-]; the paper does not state its own."""
MAX_DAMPING = 0.999
_LOGARITHMIC = ("mass", "inertia", "bending_compliance")


@dataclass(frozen=True)
class _HorizonStart:
    """Beginning of a horizon."""

    time: int
    """Time [ns]."""
    state: RodState
    """State of the model with its nodes at the observed positions."""


class PaperAdaptation:
    """Adaptation of one `XpbdRod` by gradient descent."""

    parameter_set: Literal["rod", "xpbd"] = "xpbd"
    informs_planner = False

    def __init__(self, rod: XpbdRod, settings: PaperControl) -> None:
        self.properties: XpbdProperties = rod.properties
        self.standing = False
        self.settled = True
        """Always: a rope that stands still gives it no information."""
        self._rod, self._settings = rod, settings
        self._adam = Adam((len(PARAMETERS),), ADAM_RATE)
        self._start: _HorizonStart | None = None

    @property
    def bending_stiffness(self) -> float:
        """EI that the ratio of bending to weight stands for, at the mass first given [N m^2]."""
        scale = self._rod.properties.mass / self.properties.mass
        return scale * self.properties.material(self._rod.node_count).bending_stiffness

    @property
    def scalars(self) -> Mapping[str, ParameterEstimate]:
        """Estimates of the five parameters; gradient descent gives no deviations."""
        return {name: ParameterEstimate(getattr(self.properties, name)) for name in PARAMETERS}

    @property
    def profiles(self) -> Mapping[str, Sequence[ParameterEstimate]]:
        """No parameters have several values."""
        return {}

    def adapt(
        self,
        begun: RodState,
        actions: Float64[np.ndarray, "H 2 6"],
        dt: float,
        seen: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
        obstacles: Float64[np.ndarray, "m 12"] | None = None,
    ) -> Float64[np.ndarray, "n 3"]:
        """Lines 14 to 19 of Algorithm 2; how the predicted last shape changes with it [m].

        Args:
            begun: The model when the horizon began.
            actions: What was executed in it.
            seen: Nodes at its end [m].
            observed: Those that count.
        """
        shapes = []

        def slope(positions: Float64[np.ndarray, "H n 3"]) -> Float64[np.ndarray, "H n 3"]:
            shapes.append(positions[-1])
            miss = np.where(observed[:, None], positions[-1] - seen, 0.0)
            pull = np.zeros_like(positions)
            pull[-1] = miss / np.maximum(np.linalg.norm(miss, axis=1, keepdims=True), 1e-9)
            return pull

        for _ in range(self._settings.optimizer_steps):
            rod = self._rod.with_properties(self.properties)
            spec = RolloutSpec(begun, actions, dt, obstacles=obstacles)
            answer = rod.gradient(spec, slope)
            self._move(answer.parameters)
        return shapes[-1] - shapes[0]

    def update(
        self,
        estimator: StateEstimator,
        stamp: int,
        nodes: Float64[np.ndarray, "n 3"],
        sigma: Float64[np.ndarray, "n"],
        observed: Bool[np.ndarray, "n"],
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Takes in an observation; how the model changes with it [m], if a horizon has passed.

        Args:
            estimator: Whose model shall become the rope's.
            stamp: Of the observation [ns].
            sigma: Not used: all that is observed counts the same.
        """
        record = self._start
        if record is not None and not estimator.start_time <= record.time:
            record = None
        if record is None:
            self._begin(estimator)
            return None
        dt = self._settings.time_step
        elapsed = (stamp - record.time) * 1e-9
        if elapsed < self._settings.horizon * dt:
            return None
        steps = round(elapsed / dt)
        times = record.time + np.arange(steps + 1) * (stamp - record.time) // steps
        ends = np.stack([estimator.model_nodes_at(int(t))[[0, -1]] for t in times])
        actions = np.zeros((steps, 2, 6))
        actions[:, :, :3] = np.diff(ends, axis=0) / (elapsed / steps)
        change = self.adapt(record.state, actions, elapsed / steps, nodes, observed)
        self._begin(estimator)
        return change

    def _begin(self, estimator: StateEstimator) -> None:
        seen = replace(estimator.state, positions=estimator.nodes)
        self._start = _HorizonStart(estimator.time, seen)

    def _move(self, slopes: dict[str, float]) -> None:
        """Take one step of Adam."""
        p = self.properties
        pull = [
            slopes[name] * (getattr(p, name) if name in _LOGARITHMIC else 1.0)
            for name in PARAMETERS
        ]
        steps = dict(zip(PARAMETERS, self._adam.step(np.array(pull)).tolist(), strict=True))
        changed = {
            name: getattr(p, name) * np.exp(step)
            if name in _LOGARITHMIC
            else float(np.clip(getattr(p, name) + step, 0.0, MAX_DAMPING))
            for name, step in steps.items()
        }
        self.properties = replace(p, **{name: float(value) for name, value in changed.items()})

"""Online adaptation of the paper, eq. (15): gradient descent on the error of the last horizon.

After a horizon, its actions are rolled out once more from its start, and Adam changes all five
parameters to reduce the distance of the last shape from the observed one, in as many steps as the
horizon was optimized. Interpretation: the norm is the sum of node distances, as in (12); m,
I and beta_b change by their logarithms, so that none becomes negative; Adam keeps its moments from
horizon to horizon. Scaling m, I and 1 / beta_b together leaves every motion as it is: only their
ratios can be found.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
import torch
from jaxtyping import Bool, Float64

from lariat.control.estimation.adaptation import ParameterEstimate
from lariat.control.estimation.grip_errors import GripErrors
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.paper.xpbd import PARAMETERS, XpbdProperties, XpbdRod
from lariat.rod import RodState, RolloutSpec
from lariat.scenario.sections import PaperControl

ADAM_RATE = 2e-3
"""Learning rate of Adam on logarithms and damping [-]; the paper does not state its own."""
MAX_DAMPING = 0.999
"""Largest damping factor of the rod [-]."""
_LOGARITHMIC = ("mass", "inertia", "bending_compliance")
"""Parameters that change by their logarithms."""


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
    grip_errors = GripErrors.none()
    """Errors of the grips, which this method does not estimate."""
    distribution = np.zeros(0), np.zeros((0, 0))
    """Distribution of the unknowns, of which this method states none."""

    def __init__(self, rod: XpbdRod, settings: PaperControl) -> None:
        """Create an adaptation that has learnt nothing.

        Args:
            rod: Rod with the given parameters.
            settings: Steps of the paper.
        """
        self.properties: XpbdProperties = rod.properties
        self.standing = False
        self.settled = True
        """Always true: a rope that stands still gives this method no information."""
        self._rod, self._settings = rod, settings
        # Logarithms relative to the given parameters, and the damping factors themselves.
        start = [0.0 if n in _LOGARITHMIC else getattr(rod.properties, n) for n in PARAMETERS]
        self._values = torch.tensor(start, dtype=torch.float64)
        self._optimizer = torch.optim.Adam([self._values], lr=ADAM_RATE)
        self._start: _HorizonStart | None = None

    @property
    def rod(self) -> XpbdRod:
        """Rod with the parameters learnt so far."""
        return self._rod.with_properties(self.properties)

    @property
    def bending_stiffness(self) -> float:
        """EI [N m^2] that gives the learnt ratio of bending to weight at the given mass."""
        scale = self._rod.properties.mass / self.properties.mass
        return scale * self.properties.material(self._rod.node_count).bending_stiffness

    @property
    def scalars(self) -> Mapping[str, ParameterEstimate]:
        """Estimates of the five parameters; gradient descent gives no deviations."""
        return {name: ParameterEstimate(getattr(self.properties, name)) for name in PARAMETERS}

    @property
    def profiles(self) -> Mapping[str, Sequence[ParameterEstimate]]:
        """Empty: no parameter has several values."""
        return {}

    def adapt(
        self,
        start: RodState,
        actions: Float64[np.ndarray, "H 2 6"],
        dt: float,
        nodes: Float64[np.ndarray, "n 3"],
        observed: Bool[np.ndarray, "n"],
        obstacles: Float64[np.ndarray, "m 13"] | None = None,
    ) -> Float64[np.ndarray, "n 3"]:
        """Change the parameters, lines 14 to 19 of Algorithm 2.

        Args:
            start: State of the model at the start of the horizon.
            actions: Executed velocities of the ends [m/s, rad/s].
            dt: Duration of a step [s].
            nodes: Observed nodes at the end of the horizon [m].
            observed: Nodes that were seen; the others do not count.
            obstacles: Obstacles of the rod, packed.

        Returns:
            Change of the predicted last shape [m].
        """
        shapes = []

        def cost_gradient(positions: Float64[np.ndarray, "H n 3"]) -> Float64[np.ndarray, "H n 3"]:
            shapes.append(positions[-1])
            miss = np.where(observed[:, None], positions[-1] - nodes, 0.0)
            gradient = np.zeros_like(positions)
            gradient[-1] = miss / np.maximum(np.linalg.norm(miss, axis=1, keepdims=True), 1e-9)
            return gradient

        for _ in range(self._settings.optimizer_steps):
            spec = RolloutSpec(start, actions, dt, obstacles=obstacles)
            self._descend(self.rod.gradient(spec, cost_gradient).parameters)
        return shapes[-1] - shapes[0]

    def update(
        self, estimator: StateEstimator, rope: RopeObservation
    ) -> Float64[np.ndarray, "n 3"] | None:
        """Take in an observation, as of `Adaptation`; the change [m] once a horizon has passed.

        All observed nodes count the same, whatever their sigma.
        """
        start = self._start
        if start is None or estimator.start_time > start.time:
            self._begin(estimator)
            return None
        dt = self._settings.time_step
        elapsed = (rope.stamp - start.time) * 1e-9
        if elapsed < self._settings.horizon * dt:
            return None
        steps = round(elapsed / dt)
        times = start.time + np.arange(steps + 1) * (rope.stamp - start.time) // steps
        ends = np.stack([estimator.model_nodes_at(int(t))[[0, -1]] for t in times])
        actions = np.zeros((steps, 2, 6))
        actions[:, :, :3] = np.diff(ends, axis=0) / (elapsed / steps)
        change = self.adapt(start.state, actions, elapsed / steps, rope.nodes, rope.observed)
        self._begin(estimator)
        return change

    def _begin(self, estimator: StateEstimator) -> None:
        """Begin a horizon at the estimated state."""
        state = replace(estimator.state, positions=estimator.nodes)
        self._start = _HorizonStart(estimator.time, state)

    def _descend(self, derivatives: dict[str, float]) -> None:
        """Take one step of Adam."""
        p = self.properties
        gradient = [
            derivatives[name] * (getattr(p, name) if name in _LOGARITHMIC else 1.0)
            for name in PARAMETERS
        ]
        self._values.grad = torch.tensor(gradient, dtype=torch.float64)
        self._optimizer.step()
        for name, value in zip(PARAMETERS, self._values, strict=True):
            if name not in _LOGARITHMIC:
                value.clamp_(0.0, MAX_DAMPING)
        changed = {
            name: getattr(self._rod.properties, name) * math.exp(value)
            if name in _LOGARITHMIC
            else value
            for name, value in zip(PARAMETERS, self._values.tolist(), strict=True)
        }
        self.properties = replace(p, **changed)

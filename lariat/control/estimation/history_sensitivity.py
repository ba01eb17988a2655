"""Sensitivity of a rope to what it shows by its history: dampings, friction and set."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.state_estimator import StateEstimator
from lariat.geometry.obstacles import has_friction
from lariat.rod import Rod, RodState, RolloutSpec
from lariat.trajectory import MotionState, mean_twists

LOG_DIFFERENCE = 0.3
"""Difference between a parameter of two models, as a logarithm [-]."""
MAX_MODEL_STEP = 0.011
"""Longest step of the models [s]."""
HISTORY_TIME = 0.5
"""Time for which derivatives are kept [s]; after a longer gap the models restart."""


class HistorySensitivity:
    """Derivative of the node positions with respect to the logarithms of scalar parameters.

    It is the difference of models that follow the same motion, each with more of one parameter.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Create a sensitivity without history.

        Args:
            names: Names of the parameters.
        """
        self._names = names
        self._more_set: list[Float64[np.ndarray, "b l 3"] | float] = [0.0] * len(names)
        """What each model keeps beyond the rope at the next restart [1/m]."""
        self._states: list[RodState] = []
        self._motion: MotionState | None = None
        self._time = 0
        self._jacobians: deque[tuple[int, Float64[np.ndarray, "n 3 q"]]] = deque()

    def reset(self) -> None:
        """Restart the models from the next estimate, after a change of the material.

        They have the sets that they would have, had the rope always been of their materials.
        """
        self._more_set = [self._set_difference(k) for k in range(len(self._names))]
        self._states = []

    def _set_difference(self, k: int) -> Float64[np.ndarray, "b l 3"] | float:
        """Return what a model keeps beyond the present one [1/m]; zero without a set."""
        if not self._states:
            return self._more_set[k]
        more, present = self._states[k].plastic_curvature, self._states[-1].plastic_curvature
        return 0.0 if more is None or present is None else more - present

    def set_change(self, changes: Mapping[str, float]) -> Float64[np.ndarray, "b l 3"] | float:
        """Return what the rope would keep beyond its set with other parameters, to first order.

        Args:
            changes: Changes of the logarithms of parameters, by name.
        """
        return sum(
            changes.get(name, 0.0) / LOG_DIFFERENCE * self._set_difference(k)
            for k, name in enumerate(self._names)
        )

    def follow(self, estimator: StateEstimator) -> None:
        """Move the models along the measured motion.

        Args:
            estimator: State estimator of the rope.
        """
        if not self._names:
            return
        elapsed = (estimator.time - self._time) * 1e-9
        if not self._states or self._motion is None or not 0.0 < elapsed < HISTORY_TIME:
            state, kept = estimator.state, estimator.state.plastic_curvature
            self._states = [
                state if kept is None else replace(state, plastic_curvature=kept + more)
                for more in (*self._more_set, 0.0)
            ]
            self._jacobians.clear()
        else:
            steps = max(1, math.ceil(elapsed / MAX_MODEL_STEP))
            action = mean_twists(self._motion, estimator.held_motion, elapsed).reshape(1, 2, 6)
            blocks = np.zeros(steps, dtype=np.int64)
            supports = estimator.supports
            rough = has_friction(supports)

            def moved(rod: Rod, state: RodState) -> RodState:
                dt = elapsed / steps
                spec = RolloutSpec(state, action, dt, block_of_step=blocks, obstacles=supports)
                return rod.rollout(spec).final

            present = moved(estimator.rod, self._states[-1])
            # Without friction on any body, a factor on it changes nothing.
            self._states = [
                moved(rod, state) if rough or name != "friction_factor" else present
                for name, rod, state in zip(
                    self._names, self._rods(estimator.rod), self._states[:-1], strict=True
                )
            ]
            self._states.append(present)
            *varied, present = (state.positions for state in self._states)
            changes = np.stack([positions - present for positions in varied], axis=-1)
            self._jacobians.append((estimator.time, changes / LOG_DIFFERENCE))
            while (estimator.time - self._jacobians[0][0]) * 1e-9 > HISTORY_TIME:
                self._jacobians.popleft()
        self._motion, self._time = estimator.held_motion, estimator.time

    def jacobian_at(self, stamp: int) -> Float64[np.ndarray, "n 3 q"] | None:
        """Derivative of the node positions at the time nearest to a stamp [m].

        Args:
            stamp: Time [ns].
        """
        if not self._jacobians:
            return None
        return min(self._jacobians, key=lambda entry: abs(entry[0] - stamp))[1]

    def _rods(self, rod: Rod) -> list[Rod]:
        """Return a rod for each parameter, with more of it."""
        p, factor = rod.properties, math.exp(LOG_DIFFERENCE)
        return [
            rod.with_properties(p.with_values({name: [getattr(p, name) * factor]}))
            for name in self._names
        ]

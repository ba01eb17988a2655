"""Sensitivity of a swinging rope to its damping, by a second model with more damping."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.state_estimator import StateEstimator
from lariat.rod import Rod, RodState, RolloutSpec
from lariat.trajectory import MotionState, mean_twists

LOG_DAMPING_DIFFERENCE = 0.3
"""Difference of the second model's damping, as a logarithm [-]."""
MAX_MODEL_STEP = 0.011
"""Longest step of both models [s]."""
HISTORY_TIME = 0.5
"""Time for which derivatives are kept [s]; after a longer gap both models restart."""


class DampingSensitivity:
    """Derivative of the node positions with respect to the logarithm of the damping.

    It is the difference of two models that follow the same motion, one of them with more damping.
    """

    def __init__(self) -> None:
        """Create a sensitivity without history."""
        self._states: list[RodState] = []
        self._motion: MotionState | None = None
        self._time = 0
        self._jacobians: deque[tuple[int, Float64[np.ndarray, "n 3"]]] = deque()

    def reset(self) -> None:
        """Restart both models from the next estimate, after a change of the material."""
        self._states = []

    def follow(self, estimator: StateEstimator) -> None:
        """Move both models along the measured motion.

        Args:
            estimator: State estimator of the rope.
        """
        elapsed = (estimator.time - self._time) * 1e-9
        if not self._states or self._motion is None or not 0.0 < elapsed < HISTORY_TIME:
            self._states = [estimator.state, estimator.state]
            self._jacobians.clear()
        else:
            steps = max(1, math.ceil(elapsed / MAX_MODEL_STEP))
            action = mean_twists(self._motion, estimator.held_motion, elapsed).reshape(1, 2, 6)
            blocks = np.zeros(steps, dtype=np.int64)
            self._states = [
                rod.rollout(
                    RolloutSpec(
                        state,
                        action,
                        elapsed / steps,
                        block_of_step=blocks,
                        obstacles=estimator.supports,
                    )
                ).final
                for rod, state in zip(_pair(estimator.rod), self._states, strict=True)
            ]
            damped, present = (state.positions for state in self._states)
            self._jacobians.append((estimator.time, (damped - present) / LOG_DAMPING_DIFFERENCE))
            while (estimator.time - self._jacobians[0][0]) * 1e-9 > HISTORY_TIME:
                self._jacobians.popleft()
        self._motion, self._time = estimator.held_motion, estimator.time

    def jacobian_at(self, stamp: int) -> Float64[np.ndarray, "n 3"] | None:
        """Derivative of the node positions at the time nearest to a stamp [m].

        Args:
            stamp: Time [ns].
        """
        if not self._jacobians:
            return None
        return min(self._jacobians, key=lambda entry: abs(entry[0] - stamp))[1]


def _pair(rod: Rod) -> tuple[Rod, Rod]:
    """Rod with more damping, and the rod itself."""
    damped = replace(
        rod.properties, damping=rod.properties.damping * math.exp(LOG_DAMPING_DIFFERENCE)
    )
    return rod.with_properties(damped), rod

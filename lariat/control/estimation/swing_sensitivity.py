"""Sensitivity of a swinging rope to what shapes at rest do not show, such as its damping."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Sequence

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.state_estimator import StateEstimator
from lariat.rod import Rod, RodState, RolloutSpec
from lariat.trajectory import MotionState, mean_twists

LOG_DIFFERENCE = 0.3
"""Difference between a parameter of two models, as a logarithm [-]."""
MAX_MODEL_STEP = 0.011
"""Longest step of the models [s]."""
HISTORY_TIME = 0.5
"""Time for which derivatives are kept [s]; after a longer gap the models restart."""


class SwingSensitivity:
    """Derivative of the node positions with respect to the logarithms of scalar parameters.

    It is the difference of models that follow the same motion, each with more of one parameter.
    """

    def __init__(self, names: Sequence[str]) -> None:
        """Create a sensitivity without history.

        Args:
            names: Names of the parameters.
        """
        self._names = names
        self._states: list[RodState] = []
        self._motion: MotionState | None = None
        self._time = 0
        self._jacobians: deque[tuple[int, Float64[np.ndarray, "n 3 q"]]] = deque()

    def reset(self) -> None:
        """Restart the models from the next estimate, after a change of the material."""
        self._states = []

    def follow(self, estimator: StateEstimator) -> None:
        """Move the models along the measured motion.

        Args:
            estimator: State estimator of the rope.
        """
        if not self._names:
            return
        elapsed = (estimator.time - self._time) * 1e-9
        if not self._states or self._motion is None or not 0.0 < elapsed < HISTORY_TIME:
            self._states = [estimator.state] * (1 + len(self._names))
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
                for rod, state in zip(self._rods(estimator.rod), self._states, strict=True)
            ]
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
        """Return a rod for each parameter with more of it, and the rod itself."""
        p, factor = rod.properties, math.exp(LOG_DIFFERENCE)
        varied = [p.with_values({name: [getattr(p, name) * factor]}) for name in self._names]
        return [*(rod.with_properties(properties) for properties in varied), rod]

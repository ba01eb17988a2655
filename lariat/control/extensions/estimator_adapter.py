"""State estimator from outside, whose nodes replace those of Lariat's estimator."""

from __future__ import annotations

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import EstimatorSettings, StateEstimator
from lariat.protocols import EstimatorSetup, NodeObservation
from lariat.protocols import StateEstimator as StateEstimatorProtocol
from lariat.rod import Rod
from lariat.scenario.extensions import Extension
from lariat.trajectory import NANOSECONDS, MotionState


class EstimatorAdapter(StateEstimator):
    """Estimator that takes the nodes from a `lariat.protocols.StateEstimator`.

    The rod is moved by the grips as ever and holds what nodes do not show; the offset from it to
    the estimated nodes is the other estimator's.
    """

    def __init__(
        self,
        extension: Extension,
        rod: Rod,
        motion: MotionState,
        time: int,
        settings: EstimatorSettings | None = None,
    ) -> None:
        """Create the estimator of a rope at rest.

        Args:
            extension: Name of the other estimator.
            rod: Model of the rope.
            motion: Motion of the grips.
            time: Time of that motion [ns].
            settings: Time steps of the rod.

        Raises:
            ConfigurationError: The class cannot be imported or is no state estimator.
        """
        self._extension = extension
        self._own: StateEstimatorProtocol = extension.create(
            ("reset", "estimate"), EstimatorSetup(rod)
        )
        super().__init__(rod, motion, time, settings)

    def restart(
        self,
        motion: MotionState,
        time: int,
        seen: Float64[np.ndarray, "n 3"] | None = None,
        turns: int = 0,
    ) -> None:
        super().restart(motion, time, seen, turns)
        with self._extension.guarded("reset"):
            self._own.reset(time * NANOSECONDS, motion, self.state.positions.copy())

    def advance(self, motion: MotionState, time: int) -> None:
        if time <= self.time:
            return
        super().advance(motion, time)
        self._take(None)

    def observe(self, rope: RopeObservation) -> None:
        if np.any(rope.observed):
            error = rope.nodes - self.model_nodes_at(rope.stamp) - self.offset
            self.innovation = float(np.mean(np.linalg.norm(error, axis=1)[rope.observed]))
        arrays = (array.copy() for array in (rope.nodes, rope.sigma, rope.observed))
        self._take(NodeObservation(rope.stamp * NANOSECONDS, *arrays))

    def _take(self, observation: NodeObservation | None) -> None:
        """Take the estimated nodes as the offset from the rod's."""
        with self._extension.guarded("estimate"):
            answer = self._own.estimate(self.time * NANOSECONDS, self.motion, observation)
        nodes = self._extension.checked("estimate", answer, self.state.positions.shape)
        self.offset = nodes - self.state.positions
        self.offset[[0, -1]] = 0.0

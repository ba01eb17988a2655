"""Tracker of the rope: state, material and prediction error from the grips and the images.

What the other modules know of the rope they read here; nothing here knows of runs and paths.
"""

from __future__ import annotations

import logging
from dataclasses import replace

import numpy as np
from jaxtyping import Float64

from lariat.control.estimation.adaptation import Adaptation, apply_material
from lariat.control.estimation.observation_registration import away_from_grips, registered_nodes
from lariat.control.estimation.prediction_monitor import PredictionMonitor
from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.state_estimator import StateEstimator
from lariat.reset_counter import ResetCounter
from lariat.trajectory import SECOND, MotionState

log = logging.getLogger(__name__)

MAX_GAP = 10 * SECOND
"""Time between two states of the grips above which the estimate begins anew [ns]."""
MAX_P_WRONG = 0.03
"""Probability that what is seen is not the held rope, above which it is no observation [-]."""


class RopeTracker:
    """Tracker of one rope between two grips."""

    def __init__(self, estimator: StateEstimator, adaptation: Adaptation, turns: int) -> None:
        """Track a rope that has not been seen yet.

        Args:
            estimator: State estimator of the rope.
            adaptation: Adaptation of its material.
            turns: Whole turns of twist with which the rope is held.
        """
        self.estimator, self.adaptation = estimator, adaptation
        self.predictions = PredictionMonitor()
        self.last_seen: int | None = None
        """Time of the last step with an observation of the rope [ns]."""
        self.image_stamp = 0
        """Time of the image of that observation [ns]."""
        self.p_wrong = 0.0
        """Probability that the newest nodes are not those of the rope [-]."""
        self.observed: Float64[np.ndarray, "n 3"] = estimator.nodes
        """Nodes of the rope as observed last; estimated ones where it was not seen [m]."""
        self.problem = ""
        """Reason why the rope cannot hang between the grips; empty where it can."""
        self._turns = turns
        self._resets = ResetCounter()
        self._begun = False
        """Whether the estimate began where the grips were; False where it must begin anew."""

    def advance(self, motion: MotionState, stamp: int, reset_count: int) -> bool:
        """Move the model with the grips; return False where the estimate must begin anew.

        Args:
            motion: Measured motion of the grips.
            stamp: Time of that motion [ns].
            reset_count: Resets of the cell.
        """
        if self._resets.advanced(reset_count):
            self._begun = False
        if not self._begun or abs(stamp - self.estimator.time) >= MAX_GAP:
            return False
        self.estimator.advance(motion, stamp)
        return True

    def begin(self, motion: MotionState, stamp: int) -> bool:
        """Begin the estimate anew; return False where the rope does not reach from grip to grip.

        Args:
            motion: Measured motion of the grips.
            stamp: Time of that motion [ns].
        """
        self.last_seen = None
        self._begun = self._restart(motion, stamp, turns=self._turns)
        return self._begun

    def forget(self) -> None:
        """Let the estimate begin anew with the next state of the grips."""
        self._begun = False

    def _restart(
        self, motion: MotionState, stamp: int, nodes: np.ndarray | None = None, turns: int = 0
    ) -> bool:
        """Restart the state estimate; False where the rope does not reach from grip to grip.

        An arm may stand anywhere before it is armed.
        """
        try:
            self.estimator.restart(motion, stamp, nodes, turns)
        except ValueError as error:
            if not self.problem:
                log.warning("waiting for the grips: %s", error)
            self.problem = str(error)
            return False
        self.problem = ""
        return True

    def observe(
        self, seen: RopeObservation, now: int, *, adapts: bool, resting: bool, following: bool
    ) -> RopeObservation | None:
        """Take in an observation; return what counts of it, None where it is none of this rope.

        Args:
            seen: Observation of the rope.
            now: Present time [ns].
            adapts: Whether the material is learnt.
            resting: Whether the commanded motion has come to rest.
            following: Whether the arms follow a path.
        """
        estimator, count = self.estimator, self.estimator.rod.node_count
        # A rope that perception has lost is not seen, however doubtful it was before.
        self.p_wrong = seen.p_wrong if len(seen.nodes) else 0.0
        late = seen.stamp < estimator.oldest
        if self.p_wrong > MAX_P_WRONG or late or len(seen.nodes) != count:
            return None
        rope = self._registered(seen) if adapts else seen
        estimator.observe(rope)
        if estimator.diverged and resting:
            self._restart(estimator.motion, estimator.time, rope.nodes, estimator.turns)
        estimate = estimator.model_nodes_at(rope.stamp) + estimator.offset
        self.observed = np.where(rope.observed[:, None], rope.nodes, estimate)
        self.predictions.observe(rope)
        if np.any(rope.observed):
            # Bridged nodes alone are no observation of the rope.
            self.last_seen, self.image_stamp = now, rope.stamp
        if adapts:
            change = self.adaptation.update(estimator, rope)
            if change is not None:
                apply_material(estimator, self.adaptation, change, moving=following)
        return rope

    def _registered(self, rope: RopeObservation) -> RopeObservation:
        """Observation of a rope whose length and grips are being learnt."""
        model = self.estimator.model_nodes_at(rope.stamp)
        length = self.estimator.rod.properties.length
        nodes = registered_nodes(rope.nodes, model, length)
        return replace(rope, nodes=nodes, observed=away_from_grips(rope.observed, length))

"""Watch of the rope during a run: its progress, and whether it slips or hangs on something."""

from __future__ import annotations

import logging
from collections.abc import Sequence

from lariat.control.estimation.rope_observation import RopeObservation
from lariat.control.estimation.rope_tracker import RopeTracker
from lariat.control.run.reasons import ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import Task
from lariat.control.supervision.progress import ProgressMonitor
from lariat.control.supervision.replanning import Cause, Replanning
from lariat.control.supervision.slip_detector import SlipDetector
from lariat.control.supervision.snag_detector import Snag, SnagDetector
from lariat.geometry.obstacles import Obstacle
from lariat.trajectory import NANOSECONDS

log = logging.getLogger(__name__)

MAX_LEAD = 0.1
"""Time by which an image may be newer than the arms' state that its ends are compared with [s];
moving grips leave a model behind whose arms have not spoken for longer."""


class RopeWatch:
    """Watch that compares every observation of the rope with goal, grips and model."""

    def __init__(
        self, task: Task, rope: RopeTracker, progress: ProgressMonitor, replanning: Replanning
    ) -> None:
        """Watch the rope of one task."""
        self._task, self._rope = task, rope
        self._progress, self._replanning = progress, replanning
        self._slip_detector, self._snag_detector = SlipDetector(), SnagDetector()

    def observe(
        self,
        seen: RopeObservation,
        rope: RopeObservation,
        obstacles: Sequence[Obstacle],
        *,
        following: bool,
    ) -> None:
        """Take in an observation.

        Args:
            following: Whether a path is being followed.
        """
        estimator, goal = self._rope.estimator, self._task.goal
        # The run is judged by the estimate, because noise would add to every distance.
        model = estimator.model_nodes_at(rope.stamp)
        self._progress.observe(
            rope.stamp,
            model + estimator.offset,
            goal.nodes,
            obstacles,
            goal.counted,
            # The model's ends lie in the grips: noise would turn observed tangents.
            goal.angle(model),
        )
        self._detect_slip(seen)
        self._detect_snag(rope, following=following)

    def _detect_slip(self, rope: RopeObservation) -> None:
        """Give up when the rope has slipped out of a grip."""
        if self._task.state is not RunState.RUNNING:
            self._slip_detector.reset()
            return
        estimator = self._rope.estimator
        if (rope.stamp - estimator.time) * NANOSECONDS > MAX_LEAD:
            return
        grips = estimator.model_nodes_at(rope.stamp)[[0, -1]]
        slip = self._slip_detector.observe(rope.nodes, rope.observed, grips)
        if slip is None:
            return
        self._slip_detector.reset()
        self._task.apply(
            RunEvent.GIVE_UP, ReasonCode.SLIPPED, side=slip.side, distance_mm=1e3 * slip.distance
        )
        log.warning("%s", self._task.reason)

    def _detect_snag(self, rope: RopeObservation, *, following: bool) -> None:
        """Stop when the rope hangs on something, before the grips stretch it."""
        # A rope that has left a grip looks taut beside the model.
        suspicious = following and not self._slip_detector.suspects
        if self._task.state is not RunState.RUNNING or not suspicious:
            self._snag_detector.reset()
            return
        estimator = self._rope.estimator
        snag = self._snag_detector.observe(
            rope.stamp,
            rope.nodes,
            estimator.model_nodes_at(rope.stamp),
            rope.observed,
            estimator.rod.properties.length,
            leaning=estimator.leaning,
        )
        if snag is None:
            return
        self._snag_detector.reset()
        if estimator.switch_equilibrium(rope.nodes, rope.observed):
            log.info(
                "the rope rests in another equilibrium than the model; the model is restarted there"
            )
        else:
            self.snagged(snag)

    def snagged(self, snag: Snag) -> None:
        """Stop a rope that stays behind, for another path; give up if it hangs on something."""
        behind = snag.sign == "stays_behind"
        deviation = self._rope.predictions.max_deviation
        if behind and self._replanning.request_careful(Cause.SNAG, deviation):
            log.info("the rope stays behind the model; the arms stop, for another path from there")
            return
        code = ReasonCode.SNAG_STAYS_BEHIND if behind else ReasonCode.SNAG_TAUT
        x, y, z = snag.position.tolist()
        self._task.apply(RunEvent.GIVE_UP, code, x=x, y=y, z=z)
        log.warning("%s", self._task.reason)

"""Choice of the path: which answer of the planner is followed, and when, and which is outdated."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from lariat.control.estimation.adaptation import Adaptation
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.state_machine import RunEvent
from lariat.control.run.task import Task
from lariat.control.supervision.replanning import Cause, Replanning
from lariat.trajectory import SECOND, MotionState

MAX_PATH_START_ERROR = 0.003
"""Distance between the start of a path and the grips above which it is not followed [m]."""
MAX_LEARNING_TIME = 3 * SECOND
"""Longest time that a run waits while the material is learnt from the rest shape [ns]."""
REPLAN_STIFFNESS_CHANGE = 0.2
"""Change of the stiffness's logarithm that makes a path worth planning again [-]."""
SIGNIFICANT_DEVIATIONS = 2.0
"""Change of the stiffness, in its standard deviations, that makes the rest of a path worth planning
again [-]."""


@dataclass(frozen=True)
class PathOffer:
    """Answer of the planner."""

    stamp: int
    """Time of the state that it starts from [ns]."""
    goal_revision: int
    """Goal that it leads to."""
    replan_count: int
    """Request that it answers."""
    found: bool
    """Whether there is a path."""
    answer: str
    """Reason why there is none, or why it ends short of the goal, in words."""
    bending_stiffness: float
    """EI of the rope that it was planned for [N m^2]; 0 in recordings without this field."""
    node_count: int
    """Nodes of the rope that it was planned for; 0 where there is no path."""
    others_revision: int
    """Revision of the other ropes that it is clear of."""
    motion_run_started: int
    """Start of the run whose motions of obstacles it knows [ns]; 0 where it knows none."""
    start_after: int
    """Time from which it may begin [ns]; 0: at once."""
    start_before: int
    """Time until which it has to begin [ns]; 0: at any time."""
    certain_clearance: float
    """Clearance that it keeps with a probability of 99 % [m]."""
    trajectory: Callable[[], ReferenceTrajectory]
    """Its points, converted only when they are asked for."""


class PathChoice:
    """Choice among the planner's answers to the requests of one task."""

    def __init__(
        self,
        task: Task,
        adaptation: Adaptation,
        replanning: Replanning,
        node_count: int,
        *,
        certain_clearance: float | None = None,
        obstacles_move: bool = False,
    ) -> None:
        """Choose the paths of one task.

        Args:
            certain_clearance: Clearance that a path has to keep with a probability of 99 % [m].
            obstacles_move: Whether obstacles move, so that a path has to know the run's motions.
        """
        self._task, self._adaptation, self._replanning = task, adaptation, replanning
        self._node_count, self._obstacles_move = node_count, obstacles_move
        self._least = -math.inf if certain_clearance is None else certain_clearance
        self._planned_stiffness = adaptation.bending_stiffness
        self._learning_until = 0
        """Time until which a run has waited for the rope to be learnt [ns]."""
        self._followed: tuple[int, int] | None = None
        self._retried_run = ""
        """Run for which a refusal older than itself was answered with another request."""

    @property
    def follows_latest(self) -> bool:
        """Whether the path followed last answers the latest request."""
        return self._followed == self._wanted

    @property
    def _wanted(self) -> tuple[int, int]:
        return self._task.goal_revision, self._task.replan_count

    def review(self, offer: PathOffer | None, now: int) -> Reason | None:
        """Reason not to follow a path yet; None when it can be followed.

        Gives up when there is no path to the goal.

        Args:
            offer: Latest answer of the planner; None before the first one.
            now: Present time [ns].
        """
        task = self._task
        if offer is None or not self._answers(offer):
            return Reason(ReasonCode.WAITING_FOR_PATH)
        if not offer.found:
            if offer.stamp < task.run_started and self._retried_run != task.run:
                # The obstacle of an attempt before this run may be gone.
                self._retried_run = task.run
                task.request_path()
                return Reason(ReasonCode.WAITING_FOR_PATH)
            task.apply(RunEvent.GIVE_UP, ReasonCode.NO_PATH, answer=offer.answer)
            return task.reason
        if self._learning(now):
            self._learning_until = now
            return Reason(ReasonCode.LEARNING_MATERIAL)
        changed = self._material_changed_since(offer.bending_stiffness)
        if changed and self._replanning.request(Cause.MATERIAL):
            return Reason(ReasonCode.PATH_OUTDATED)
        return self._uncertain(offer)

    def _uncertain(self, offer: PathOffer) -> Reason | None:
        """Reason not to follow a path that may come too near to an obstacle; None if it will do.

        Requests one for the rope as it is known since, a few more careful ones, then gives up.
        """
        lack = self._least - offer.certain_clearance
        if lack <= 0.0:
            return None
        detail = {"certain_mm": 1e3 * offer.certain_clearance, "limit_mm": 1e3 * self._least}
        reason = Reason(ReasonCode.CLEARANCE_UNCERTAIN, detail)
        if offer.stamp < max(self._learning_until, self._task.run_started):
            self._task.request_path()
            return reason
        if self._replanning.request_careful(Cause.UNCERTAIN, 0.0, lack):
            return reason
        self._task.apply(RunEvent.GIVE_UP, ReasonCode.NO_PATH, answer=str(reason))
        return self._task.reason

    def _answers(self, offer: PathOffer) -> bool:
        """Whether a path is for this rope, the latest request, and this run's moving obstacles."""
        return (
            offer.node_count in (0, self._node_count)
            and (offer.goal_revision, offer.replan_count) == self._wanted
            and (not self._obstacles_move or offer.motion_run_started == self._task.run_started)
        )

    def review_start(
        self, offer: PathOffer, reference: ReferenceTrajectory, motion: MotionState, now: int
    ) -> Reason | None:
        """Reason not to begin a path here and now; requests another one where it is too late.

        Args:
            now: Present time [ns].
        """
        apart = np.linalg.norm(reference.positions[0] - motion.positions, axis=1)
        if np.max(apart) > MAX_PATH_START_ERROR:
            self._task.request_path()
            return Reason(ReasonCode.PATH_STARTS_ELSEWHERE)
        if now < offer.start_after:
            wait = (offer.start_after - now) / SECOND
            return Reason(ReasonCode.WAITING_FOR_OBSTACLE, {"seconds": wait})
        if 0 < offer.start_before < now:
            self._task.request_path()
            return Reason(ReasonCode.DEPARTURE_MISSED)
        return None

    def follow(self, offer: PathOffer | None) -> None:
        """Note that the latest path is followed.

        Args:
            offer: Answer of the planner; None where the controller stands in place of a path.
        """
        self._followed = self._wanted
        if offer is not None:
            self._planned_stiffness = offer.bending_stiffness

    @property
    def material_changed(self) -> bool:
        """Whether the stiffness has changed since the path that is followed was planned."""
        return self._material_changed_since(self._planned_stiffness)

    def outdated(self) -> bool:
        """Request another path when the material has turned out to be another one on the way.

        Returns:
            Whether another path has been requested.
        """
        if not self.material_changed:
            return False
        estimate = self._adaptation.scalars["bending_stiffness"]
        deviation = SIGNIFICANT_DEVIATIONS * estimate.standard_deviation
        if abs(estimate.value - self._planned_stiffness) < deviation:
            return False
        return self._replanning.request(Cause.MATERIAL)

    def _learning(self, now: int) -> bool:
        """Whether the run waits for more observations of the hanging rope to learn its material."""
        waited = now - self._task.run_started
        return self._task.adapts and not self._adaptation.settled and waited < MAX_LEARNING_TIME

    def _material_changed_since(self, stiffness: float) -> bool:
        """Whether the stiffness has changed from a planned one, 0 where unknown [N m^2]."""
        adaptation = self._adaptation
        if not self._task.adapts or not adaptation.informs_planner or stiffness <= 0.0:
            return False
        change = abs(math.log(adaptation.bending_stiffness / stiffness))
        return change > REPLAN_STIFFNESS_CHANGE

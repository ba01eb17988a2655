"""Supervisor of a run: when to hold, which path to follow, when to replan and when to give up."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from lariat.trajectory import MotionState
from services.controller.estimation.adaptation import Adaptation
from services.controller.mpc.reference_trajectory import ReferenceTrajectory
from services.controller.run.arm_condition import ArmCondition
from services.controller.run.clearance_guard import Threat
from services.controller.run.progress import ProgressMonitor
from services.controller.run.reasons import Reason, ReasonCode
from services.controller.run.slip_detector import Slip
from services.controller.run.snag_detector import Snag
from services.controller.run.state_machine import RunEvent, RunState
from services.controller.run.task import Task
from shared.service import SECOND


@dataclass(frozen=True)
class SupervisorSettings:
    """Thresholds and budgets of a run."""

    max_blind_time: int = 9 * SECOND // 20
    """Time without an observation of the rope after which the arms hold [ns].

    Half a second, less what an arm takes to follow, so that it has begun to brake in time.
    """
    max_doubt: float = 0.03
    """Probability that what is seen is not the held rope, above which it is no observation [-]."""
    max_tracking_error: float = 0.04
    """Distance between command and arm at which the command is given up [m].

    A CR5 lags by 0.1 s, and the gateway checks its distance from the path as well.
    """
    max_refused_chunks: int = 8
    """Chunks that the gateway may refuse in a row before another path is requested."""
    max_path_start_error: float = 0.003
    """Distance between the start of a path and the grips above which it is not followed [m]."""
    min_path_clearance: float = 0.005
    """Clearance of the rest of a path below which another one is requested [m]."""
    max_learning_time: int = 3 * SECOND
    """Longest time that a run waits while the material is learnt from the rest shape [ns]."""
    replan_stiffness_change: float = 0.2
    """Change of the stiffness's logarithm that makes a path worth planning again [-]."""
    stall_time: int = 5 * SECOND
    """Time at the end of a path without settling after which control has stalled [ns]."""
    stuck_time: int = 3 * SECOND // 2
    """Time at the end of a path before a rope at rest counts as stuck [ns]."""
    leave_error: float = 3.0
    """Error above which an uncontrolled rope has left its goal, in tolerances [-]."""
    significant_deviations: float = 2.0
    """Change of the stiffness, in its standard deviations, that makes the rest of a path worth
    planning again [-]."""
    max_stall_replans: int = 2
    """New paths that are requested after stalling, in one run."""
    max_material_replans: int = 2
    """New paths that are requested because the material has changed, in one run."""
    max_unfollowed_replans: int = 3
    """New paths that are requested because the arms did not follow one, in one run."""
    max_contact_replans: int = 4
    """New paths that are requested because the rope came too near to an obstacle, in one run."""
    margin_step: float = 0.003
    """Clearance that is added after each path that was not followed to its end [m]."""
    max_margin: float = 0.02
    """Largest clearance that is added [m]."""
    margin_deviations: float = 2.0
    """Deviations of the prediction that the added clearance covers [-]."""
    usual_deviation: float = 0.002
    """Deviation of the prediction that a path's own reserve covers [m]."""
    max_deviation: float = 0.015
    """Error of the predictions above which a path is planned again [m]."""
    max_snag_replans: int = 1
    """New paths that are requested because the rope stays behind, in one run.

    After that it hangs on something. A rope in another equilibrium than the model stays behind
    once.
    """
    max_unforeseen_replans: int = 2
    """New paths that are requested because predictions were wrong, in one run."""
    slowdown: float = 0.6
    """Factor on the pace after each path that was not followed to its end [-]."""
    min_pace: float = 0.2
    """Least pace [-]."""


@dataclass(frozen=True)
class PathOffer:
    """Answer of the planner, without its points."""

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


class RunSupervisor:
    """Supervisor that applies events of the rope, the arms and the planner to a task."""

    def __init__(
        self,
        task: Task,
        progress: ProgressMonitor,
        adaptation: Adaptation,
        settings: SupervisorSettings | None = None,
    ) -> None:
        """Supervise the runs of one task.

        Args:
            task: Task whose state changes.
            progress: Measures of the run.
            adaptation: Adaptation of the rope's material.
            settings: Thresholds and budgets.
        """
        self.settings = settings or SupervisorSettings()
        self._task, self._progress, self._adaptation = task, progress, adaptation
        self._planned_stiffness = adaptation.bending_stiffness
        self._followed: tuple[int, int] | None = None
        self._retried_run = ""
        """Run for which a refusal older than itself was answered with another request."""
        self._end_since = 0
        """Time since when the end of the path has been passed [ns]; 0 before."""
        self.begin_run()

    def begin_run(self) -> None:
        """Restore the budgets of a run."""
        self._stall_replans = self._material_replans = 0
        self._unfollowed_replans = self._contact_replans = self._unforeseen_replans = 0
        self._snag_replans = 0
        self._task.clearance_margin, self._task.pace = 0.0, 1.0

    # Conditions to hold the arms.

    def hold_reason(
        self,
        now: int,
        arms: ArmCondition,
        last_seen: int | None,
        *,
        following: bool,
        doubt: float = 0.0,
    ) -> Reason | None:
        """Reason to hold the arms; None when they can be controlled.

        Args:
            now: Present time [ns].
            arms: Condition of the arms.
            last_seen: Time of the last observation of the rope [ns]; None before the first one.
            following: Whether a path is being followed.
            doubt: Probability that what was seen since is not the rope [-]; 0 if nothing was.
        """
        task, max_blind_time = self._task, self.settings.max_blind_time
        if not task.active:
            return task.reason
        if not arms.available:
            return Reason(ReasonCode.ARMS_UNAVAILABLE, {"state": arms.reason})
        if task.resettable and task.reset_count != arms.reset_count:
            return Reason(ReasonCode.WAITING_FOR_RESET)
        if last_seen is None or now - last_seen > max_blind_time:
            if following:
                task.request_path()
            seconds = max_blind_time / SECOND
            if doubt > self.settings.max_doubt:
                return Reason(ReasonCode.ROPE_DOUBTFUL, {"seconds": seconds, "doubt": doubt})
            return Reason(ReasonCode.ROPE_NOT_SEEN, {"seconds": seconds})
        return None

    def unfollowed_reason(
        self,
        arms: ArmCondition,
        tracking_error: float,
        *,
        following: bool,
        deviation: float = 0.0,
    ) -> Reason | None:
        """Reason why the arms do not follow; requests a few other paths, then gives up.

        Args:
            arms: Condition of the arms.
            tracking_error: Distance between command and arms [m].
            following: Whether a path is being followed.
            deviation: Error of the predictions on that path [m].
        """
        reason = None
        if following and arms.refused_chunks > self.settings.max_refused_chunks:
            reason = Reason(ReasonCode.SETPOINTS_REFUSED, {"refusal": arms.refusal})
        elif tracking_error > self.settings.max_tracking_error:
            reason = Reason(ReasonCode.ARM_OFF_COURSE, {"error_mm": 1e3 * tracking_error})
        if reason is None:
            return None
        if self._unfollowed_replans >= self.settings.max_unfollowed_replans:
            self._task.apply(
                RunEvent.GIVE_UP,
                ReasonCode.PATH_NOT_FOLLOWED,
                cause=reason,
                paths=self._unfollowed_replans,
                margin_mm=1e3 * self._task.clearance_margin,
            )
            return reason
        self._unfollowed_replans += 1
        self._request_cautious_path(deviation)
        return reason

    def threatened(self, threat: Threat, path_clearance: float) -> Reason:
        """Reason to stop before a contact; requests a few more careful paths, then gives up.

        Args:
            threat: Contact that is to be expected.
            path_clearance: Clearance from its obstacle along the rest of the path [m].
        """
        detail = {
            "obstacle": threat.obstacle,
            "clearance_mm": 1e3 * threat.clearance,
            "predicted_mm": 1e3 * threat.predicted,
            "deviation_mm": 1e3 * threat.uncertainty,
        }
        if self._contact_replans >= self.settings.max_contact_replans:
            self._task.apply(
                RunEvent.GIVE_UP,
                ReasonCode.CONTACT_EXPECTED,
                **detail,
                paths=self._contact_replans,
                needed_mm=math.ceil(1e3 * max(threat.lack, threat.limit - path_clearance)),
            )
            return self._task.reason
        self._contact_replans += 1
        self._request_cautious_path(threat.uncertainty)
        return Reason(ReasonCode.APPROACHING_OBSTACLE, detail)

    def unforeseen(self, deviation: float) -> bool:
        """Request a more careful path when the rope does not move as predicted.

        Args:
            deviation: Error of the predictions [m].

        Returns:
            Whether another path has been requested.
        """
        settings = self.settings
        exhausted = self._unforeseen_replans >= settings.max_unforeseen_replans
        if deviation <= settings.max_deviation or exhausted:
            return False
        self._unforeseen_replans += 1
        self._request_cautious_path(deviation)
        return True

    def _request_cautious_path(self, deviation: float) -> None:
        """Request a path with more clearance and less speed.

        Args:
            deviation: Error of the predictions so far [m].
        """
        task, settings = self._task, self.settings
        unsure = settings.margin_deviations * max(deviation - settings.usual_deviation, 0.0)
        margin = max(task.clearance_margin + settings.margin_step, unsure)
        task.clearance_margin = min(margin, settings.max_margin)
        task.pace = max(settings.slowdown * task.pace, settings.min_pace)
        task.request_path()

    def released(self) -> None:
        """Leave the reached state when the rope has left the goal while the arms hold.

        An arm may have been moved by hand, or replaced: the rope is not led back without a start.
        """
        error = self._progress.error
        limit = self.settings.leave_error * self._progress.tolerance
        if self._task.accepts(RunEvent.LEAVE_GOAL) and error > limit:
            self._task.apply(RunEvent.LEAVE_GOAL, ReasonCode.LEFT_GOAL, error_mm=1e3 * error)

    # Choice of the path.

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
        if offer is None or (offer.goal_revision, offer.replan_count) != self._wanted:
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
            return Reason(ReasonCode.LEARNING_MATERIAL)
        if (
            self._material_changed_since(offer.bending_stiffness)
            and self._material_replans < self.settings.max_material_replans
        ):
            self._material_replans += 1
            task.request_path()
            return Reason(ReasonCode.PATH_OUTDATED)
        return None

    def review_start(self, reference: ReferenceTrajectory, motion: MotionState) -> Reason | None:
        """Reason not to follow a path that begins elsewhere; requests another one.

        Args:
            reference: Path to follow.
            motion: Present motion of the grips.
        """
        apart = np.linalg.norm(reference.positions[0] - motion.positions, axis=1)
        if np.max(apart) > self.settings.max_path_start_error:
            self._task.request_path()
            return Reason(ReasonCode.PATH_STARTS_ELSEWHERE)
        return None

    def review_departure(self, now: int, after: int, before: int) -> Reason | None:
        """Reason not to begin a path among moving obstacles yet; requests another one if too late.

        Args:
            now: Present time [ns].
            after: Time from which the path may begin [ns]; 0: at once.
            before: Time until which it has to begin [ns]; 0: at any time.
        """
        if now < after:
            wait = (after - now) / SECOND
            return Reason(ReasonCode.WAITING_FOR_OBSTACLE, {"seconds": wait})
        if 0 < before < now:
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
            self._end_since = 0
            self._planned_stiffness = offer.bending_stiffness

    def outdated(self) -> bool:
        """Request another path when the material has turned out to be another one on the way.

        Returns:
            Whether another path has been requested.
        """
        settings, planned = self.settings, self._planned_stiffness
        exhausted = self._material_replans >= settings.max_material_replans
        if exhausted or not self._material_changed_since(planned):
            return False
        estimate = self._adaptation.scalars["bending_stiffness"]
        deviation = settings.significant_deviations * estimate.standard_deviation
        if abs(estimate.value - planned) < deviation:
            return False
        self._material_replans += 1
        self._task.request_path()
        return True

    def path_obstructed(self, clearance: float) -> None:
        """Request another path when the rest of the present one is not clear in a changed scene.

        Args:
            clearance: Least clearance along the rest of the path [m].
        """
        if clearance < self.settings.min_path_clearance:
            self._task.request_path()

    # Outcome of the run.

    def snagged(self, snag: Snag, deviation: float) -> bool:
        """Stop a rope that stays behind and look again from rest; give up if it hangs on something.

        Args:
            snag: Place and sign.
            deviation: Error of the predictions so far [m].

        Returns:
            Whether the run has been given up.
        """
        if snag.sign == "stays_behind" and self._snag_replans < self.settings.max_snag_replans:
            self._snag_replans += 1
            self._request_cautious_path(deviation)
            return False
        code = {
            "stays_behind": ReasonCode.SNAG_STAYS_BEHIND,
            "taut": ReasonCode.SNAG_TAUT,
        }[snag.sign]
        x, y, z = snag.position.tolist()
        self._task.apply(RunEvent.GIVE_UP, code, x=x, y=y, z=z)
        return True

    def slipped(self, slip: Slip) -> None:
        """Give up because the rope has slipped out of a grip.

        Args:
            slip: The grip, and the distance of the rope's end from it.
        """
        self._task.apply(
            RunEvent.GIVE_UP, ReasonCode.SLIPPED, side=slip.side, distance_mm=1e3 * slip.distance
        )

    def method_failed(self, problem: str) -> None:
        """Give up because a controller or estimator from outside has failed.

        Args:
            problem: Its name and what it did.
        """
        if self._task.accepts(RunEvent.GIVE_UP):
            self._task.apply(RunEvent.GIVE_UP, ReasonCode.METHOD_FAULT, problem=problem)

    def judge(self, now: int, reference: ReferenceTrajectory, *, at_end: bool) -> None:
        """Decide whether the goal is reached, another path is needed, or the run has failed.

        Args:
            now: Present time [ns].
            reference: Path that is followed.
            at_end: Whether the end of the path has been passed.
        """
        task, progress, settings = self._task, self._progress, self.settings
        if not at_end:
            return
        if progress.settled(now):
            self._end_since = 0
            if task.accepts(RunEvent.SETTLE):
                task.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
            return
        self._end_since = self._end_since or now
        late = now - self._end_since > settings.stall_time
        resting = progress.resting(now)
        if task.state is not RunState.RUNNING or not (resting or late):
            return
        stuck = resting and progress.stuck(now) and now - self._end_since > settings.stuck_time
        # A path that ends short was planned for the rope as it was believed to be.
        changed = resting and self._material_changed_since(self._planned_stiffness)
        stalled = reference.reached and (stuck or late)
        if (changed or stalled) and self._stall_replans < settings.max_stall_replans:
            self._end_since = 0
            self._stall_replans += 1
            task.request_path()
        elif stalled:
            task.apply(
                RunEvent.GIVE_UP,
                ReasonCode.STALLED,
                error_mm=1e3 * progress.error,
                paths=settings.max_stall_replans,
            )
        elif stuck:
            task.apply(RunEvent.GIVE_UP, ReasonCode.PATH_ENDS_SHORT, answer=reference.reason)

    # Adaptation of the material.

    def _learning(self, now: int) -> bool:
        """Whether the run waits for more observations of the hanging rope to learn its material."""
        waited = now - self._task.run_started
        return (
            self._task.adapts
            and not self._adaptation.settled
            and waited < self.settings.max_learning_time
        )

    def _material_changed_since(self, stiffness: float) -> bool:
        """Whether the stiffness has changed since a path was planned.

        Args:
            stiffness: EI that the path was planned for [N m^2]; 0 when it is not known.
        """
        adaptation = self._adaptation
        if not self._task.adapts or not adaptation.informs_planner or stiffness <= 0.0:
            return False
        change = abs(math.log(adaptation.bending_stiffness / stiffness))
        return change > self.settings.replan_stiffness_change

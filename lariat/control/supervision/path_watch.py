"""Watch of a path: reasons to hold, reasons to stop on the way, and the judgement at its end."""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence

import numpy as np

from lariat.control.estimation.rope_tracker import MAX_P_WRONG, RopeTracker
from lariat.control.mpc.collision_scene import CollisionScene
from lariat.control.mpc.receding_horizon import Command, RecedingHorizonController
from lariat.control.mpc.reference_trajectory import ReferenceTrajectory
from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import Task
from lariat.control.supervision.clearance_guard import ClearanceGuard, Threat
from lariat.control.supervision.path_choice import PathChoice
from lariat.control.supervision.progress import STUCK_TIME, ProgressMonitor
from lariat.control.supervision.replanning import MAX_REPLANS, Cause, Replanning
from lariat.geometry.cable_routes import clip_names, held_clips
from lariat.geometry.obstacles import Obstacle, chain_clearance, scene_distance
from lariat.rod.strains import tensions
from lariat.trajectory import SECOND

log = logging.getLogger(__name__)

MAX_BLIND_TIME = 9 * SECOND // 20
"""Time without an observation of the rope after which the arms hold [ns].

Half a second, less what an arm takes to follow, so that it has begun to brake in time.
"""
MAX_TRACKING_ERROR = 0.04
"""Distance between command and arm at which the command is given up [m].

A CR5 lags by 0.1 s, and the gateway checks its distance from the path as well.
"""
MAX_REFUSED_CHUNKS = 25
"""Chunks that the gateway may refuse in a row before another path is requested.

Half a second: its search for the shortest path round the obstacles takes some 0.2 s.
"""
MIN_PATH_CLEARANCE = 0.005
"""Clearance of the rest of a path below which another one is requested [m]."""
MAX_DEVIATION = 0.015
"""Error of the predictions above which a path is planned again [m]."""
CLEARANCE_STRIDE = 5
"""Points of a path per shape whose clearance is checked when the scene changes."""
STALL_TIME = 5 * SECOND
"""Time at the end of a path without settling after which control has stalled [ns]."""
LEAVE_ERROR = 3.0
"""Error above which an uncontrolled rope has left its goal, in tolerances [-]."""


class PathWatch:
    """Watch over the paths that one controller follows."""

    def __init__(
        self,
        task: Task,
        rope: RopeTracker,
        scene: CollisionScene,
        controller: RecedingHorizonController,
        progress: ProgressMonitor,
        guard: ClearanceGuard,
        replanning: Replanning,
        paths: PathChoice,
    ) -> None:
        """Watch the paths of one task."""
        self._task, self._rope, self._scene = task, rope, scene
        self._controller, self._progress, self._guard = controller, progress, guard
        self._replanning, self._paths = replanning, paths
        self._start_clearance = np.inf
        """Clearance of the rope at the start of the present path [m]."""
        self._end_since = 0
        """Time since when the end of the path has been passed [ns]; 0 before."""

    def begin_path(self) -> None:
        """Begin a path: its end has not been passed, its start is as clear as the rope is."""
        self._end_since = 0
        nodes, radius = self._rope.estimator.nodes, self._progress.radius
        self._start_clearance = chain_clearance(nodes, radius, self._scene.still)

    def hold_reason(self, arms: ArmCondition, now: int) -> Reason | None:
        """Return the reason to hold the arms at `now` [ns]; None when they can be controlled.

        Another path is requested where the rope is lost, and a few times where the arms do not
        follow; then the task is given up.
        """
        task, rope, controller = self._task, self._rope, self._controller
        if not task.active:
            return task.reason
        if not arms.available:
            return Reason(ReasonCode.ARMS_UNAVAILABLE, {"state": arms.reason})
        if task.resettable and task.reset_count != arms.reset_count:
            return Reason(ReasonCode.WAITING_FOR_RESET)
        following = controller.reference is not None
        if rope.last_seen is None or now - rope.last_seen > MAX_BLIND_TIME:
            # At the goal no other path is needed: see `ControlLoop`.
            if following and task.state is RunState.RUNNING:
                task.request_path()
            seconds = MAX_BLIND_TIME / SECOND
            if rope.p_wrong > MAX_P_WRONG:
                detail = {"seconds": seconds, "p_wrong": rope.p_wrong}
                return Reason(ReasonCode.ROPE_DOUBTFUL, detail)
            return Reason(ReasonCode.ROPE_NOT_SEEN, {"seconds": seconds})
        reason, tracking_error = None, controller.tracking_error()
        if following and arms.refused_chunks > MAX_REFUSED_CHUNKS:
            reason = Reason(ReasonCode.SETPOINTS_REFUSED, {"refusal": arms.refusal})
        elif tracking_error > MAX_TRACKING_ERROR:
            reason = Reason(ReasonCode.ARM_OFF_COURSE, {"error_mm": 1e3 * tracking_error})
        deviation = rope.predictions.max_deviation
        if reason is not None and not self._replanning.request_careful(Cause.UNFOLLOWED, deviation):
            task.apply(
                RunEvent.GIVE_UP,
                ReasonCode.PATH_NOT_FOLLOWED,
                cause=reason,
                paths=MAX_REPLANS[Cause.UNFOLLOWED],
                margin_mm=1e3 * task.clearance_margin,
            )
        return reason

    def review_scene(self) -> None:
        """Request another path where the rest of the present one is not clear any more."""
        following = self._controller.reference is not None
        running = following and self._task.state is RunState.RUNNING
        if running and self._clearance_ahead(self._scene.still) < MIN_PATH_CLEARANCE:
            self._task.request_path()

    def _clearance_ahead(self, obstacles: Sequence[Obstacle]) -> float:
        """Least distance between the nodes along the rest of the path and obstacles [m]."""
        ahead = self._controller.remaining_nodes[::CLEARANCE_STRIDE]
        return float(scene_distance(ahead, obstacles).min(initial=np.inf)) - self._progress.radius

    def must_stop(self, command: Command) -> bool:
        """Whether to stop instead of a command, for another path or because there is none.

        The rope is pulled too much, has turned out to be another one, moves otherwise than
        predicted, or is about to touch an obstacle.
        """
        if self._task.state is not RunState.RUNNING:
            return False
        if self.pulled():
            return True
        deviation = self._rope.predictions.deviation
        # A rope within tolerance of its goal needs no other path. On a support it moves otherwise
        # than predicted where the friction is another, which no other path mends.
        near = self._controller.at_end or self._progress.error <= self._progress.tolerance
        leans = self._rope.estimator.leaning
        if not near and (self._paths.outdated() or (not leans and self.unforeseen(deviation))):
            return True
        threat = self._guard.check(
            self._rope.observed,
            self._rope.estimator.nodes,
            command.plan.nodes,
            deviation,
            self._scene.avoided,
            min(self._start_clearance, self._scene.goal_clearance(self._task)),
        )
        if threat is None:
            return False
        obstacle = [o for o in self._scene.avoided if o.name == threat.obstacle]
        log.info("%s", self.threatened(threat, self._clearance_ahead(obstacle)))
        return True

    def pulled(self) -> bool:
        """Give up where the model's rope is pulled more than the limit; return whether it is."""
        limit = self._controller.limits.tension
        if limit is None:
            return False
        model = self._rope.estimator
        tension = float(np.max(tensions(model.state.positions, model.rod.properties)))
        if tension <= limit:
            return False
        detail = {"tension_n": tension, "limit_n": limit}
        self._task.apply(RunEvent.GIVE_UP, ReasonCode.PULLED, **detail)
        return True

    def unforeseen(self, deviation: float) -> bool:
        """Request a more careful path where predictions are wrong [m]; return whether it is."""
        return deviation > MAX_DEVIATION and self._replanning.request_careful(
            Cause.UNFORESEEN, deviation
        )

    def threatened(self, threat: Threat, path_clearance: float) -> Reason:
        """Reason to stop before a contact; requests a few more careful paths, then gives up.

        Args:
            path_clearance: Clearance from its obstacle along the rest of the path [m].
        """
        detail = {
            "obstacle": threat.obstacle,
            "clearance_mm": 1e3 * threat.clearance,
            "predicted_mm": 1e3 * threat.predicted,
            "deviation_mm": 1e3 * threat.uncertainty,
        }
        if self._replanning.request_careful(Cause.CONTACT, threat.uncertainty):
            return Reason(ReasonCode.APPROACHING_OBSTACLE, detail)
        self._task.apply(
            RunEvent.GIVE_UP,
            ReasonCode.CONTACT_EXPECTED,
            **detail,
            paths=MAX_REPLANS[Cause.CONTACT],
            needed_mm=math.ceil(1e3 * max(threat.lack, threat.limit - path_clearance)),
        )
        return self._task.reason

    def judge(self, now: int, reference: ReferenceTrajectory, *, at_end: bool) -> None:
        """Decide whether the goal is reached, another path is needed, or the run has failed.

        Args:
            now: Present time [ns].
            at_end: Whether the end of the path has been passed.
        """
        task, progress = self._task, self._progress
        if not at_end:
            return
        if progress.settled(now):
            self._end_since = 0
            if task.accepts(RunEvent.SETTLE):
                task.apply(RunEvent.SETTLE, ReasonCode.SETTLED)
            return
        self._end_since = self._end_since or now
        late = now - self._end_since > STALL_TIME
        if late:
            self.released()
        resting = progress.resting(now)
        if task.state is not RunState.RUNNING or not (resting or late):
            return
        stuck = resting and progress.stuck(now) and now - self._end_since > STUCK_TIME
        # A path that ends short was planned for the rope as it was believed to be.
        changed = resting and self._paths.material_changed
        stalled = reference.reached and (stuck or late)
        laid = self._lies_in_clips()
        if (changed or stalled) and not laid and self._replanning.request(Cause.STALLED):
            self._end_since = 0
        elif stalled:
            why = f"{MAX_REPLANS[Cause.STALLED]} new paths did not help"
            why = "in all clips, out of which another path would pull it" if laid else why
            error = 1e3 * progress.error
            task.apply(RunEvent.GIVE_UP, ReasonCode.STALLED, error_mm=error, why=why)
        elif stuck:
            task.apply(RunEvent.GIVE_UP, ReasonCode.PATH_ENDS_SHORT, answer=reference.reason)

    def _lies_in_clips(self) -> bool:
        """Whether all clips of the goal's route hold the rope."""
        route = self._task.goal.route
        if not route:
            return False
        held = held_clips(route, self._scene.obstacles, self._rope.estimator.nodes)
        return held == clip_names(route)

    def released(self) -> None:
        """Leave the reached state when the rope has left the goal and is not led back.

        While the arms hold, one may have been moved by hand, or replaced: that needs a start.
        """
        error = self._progress.error
        limit = LEAVE_ERROR * self._progress.tolerance
        if self._task.accepts(RunEvent.LEAVE_GOAL) and error > limit:
            self._task.apply(RunEvent.LEAVE_GOAL, ReasonCode.LEFT_GOAL, error_mm=1e3 * error)

"""Conditions under which the arms hold while a task is active."""

from __future__ import annotations

from lariat.control.estimation.rope_tracker import MAX_P_WRONG, RopeTracker
from lariat.control.mpc.receding_horizon import RecedingHorizonController
from lariat.control.run.arm_condition import ArmCondition
from lariat.control.run.reasons import Reason, ReasonCode
from lariat.control.run.state_machine import RunEvent, RunState
from lariat.control.run.task import Task
from lariat.control.supervision.replanning import MAX_REPLANS, Cause, Replanning
from lariat.trajectory import SECOND

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


def hold_reason(
    task: Task,
    replanning: Replanning,
    arms: ArmCondition,
    rope: RopeTracker,
    controller: RecedingHorizonController,
    now: int,
) -> Reason | None:
    """Return the reason to hold the arms at `now` [ns]; None when they can be controlled.

    Another path is requested where the rope is lost, and a few times where the arms do not follow;
    then the task is given up.
    """
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
    if reason is not None and not replanning.request_careful(Cause.UNFOLLOWED, deviation):
        task.apply(
            RunEvent.GIVE_UP,
            ReasonCode.PATH_NOT_FOLLOWED,
            cause=reason,
            paths=MAX_REPLANS[Cause.UNFOLLOWED],
            margin_mm=1e3 * task.clearance_margin,
        )
    return reason

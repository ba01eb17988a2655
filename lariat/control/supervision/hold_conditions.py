"""Conditions under which the arms hold while a task is active."""

from __future__ import annotations

from lariat.control.estimation.rope_tracker import MAX_P_WRONG
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
MAX_REFUSED_CHUNKS = 8
"""Chunks that the gateway may refuse in a row before another path is requested."""


def hold_reason(
    task: Task,
    now: int,
    arms: ArmCondition,
    last_seen: int | None,
    *,
    following: bool,
    p_wrong: float = 0.0,
) -> Reason | None:
    """Return the reason to hold the arms; None when they can be controlled.

    Args:
        task: Task whose state decides, and which requests another path where the rope is lost.
        now: Present time [ns].
        arms: Condition of the arms.
        last_seen: Time of the last observation of the rope [ns]; None before the first one.
        following: Whether a path is being followed.
        p_wrong: Probability that what was seen since is not the rope [-]; 0 if nothing was.
    """
    if not task.active:
        return task.reason
    if not arms.available:
        return Reason(ReasonCode.ARMS_UNAVAILABLE, {"state": arms.reason})
    if task.resettable and task.reset_count != arms.reset_count:
        return Reason(ReasonCode.WAITING_FOR_RESET)
    if last_seen is None or now - last_seen > MAX_BLIND_TIME:
        # At the goal no other path is needed: see `ControlLoop`.
        if following and task.state is RunState.RUNNING:
            task.request_path()
        seconds = MAX_BLIND_TIME / SECOND
        if p_wrong > MAX_P_WRONG:
            return Reason(ReasonCode.ROPE_DOUBTFUL, {"seconds": seconds, "p_wrong": p_wrong})
        return Reason(ReasonCode.ROPE_NOT_SEEN, {"seconds": seconds})
    return None


def unfollowed_reason(
    task: Task,
    replanning: Replanning,
    arms: ArmCondition,
    tracking_error: float,
    *,
    following: bool,
    deviation: float = 0.0,
) -> Reason | None:
    """Return the reason why the arms do not follow; request a few other paths, then give up.

    Args:
        task: Task that is given up.
        replanning: Requests for other paths.
        arms: Condition of the arms.
        tracking_error: Distance between command and arms [m].
        following: Whether a path is being followed.
        deviation: Error of the predictions on that path [m].
    """
    reason = None
    if following and arms.refused_chunks > MAX_REFUSED_CHUNKS:
        reason = Reason(ReasonCode.SETPOINTS_REFUSED, {"refusal": arms.refusal})
    elif tracking_error > MAX_TRACKING_ERROR:
        reason = Reason(ReasonCode.ARM_OFF_COURSE, {"error_mm": 1e3 * tracking_error})
    if reason is not None and not replanning.request_careful(Cause.UNFOLLOWED, deviation):
        task.apply(
            RunEvent.GIVE_UP,
            ReasonCode.PATH_NOT_FOLLOWED,
            cause=reason,
            paths=MAX_REPLANS[Cause.UNFOLLOWED],
            margin_mm=1e3 * task.clearance_margin,
        )
    return reason

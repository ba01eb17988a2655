"""Trial of one fault: a phase of operation, injection, repair, resumption, motion to the goal."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator, Mapping
from typing import Any, Literal

from benchmarks.faults.cases import CASES
from benchmarks.faults.cell import FaultCell
from benchmarks.operator import POLL_PERIOD, DeadlineMissed
from lariat.safety.guard.stop_causes import STOP_CAUSES
from shared.messages import RUNNING, ArmStates
from stack.client import RequestFailed

INJECTION_SPEED, APPROACH_SPEED = 0.1, 0.03
"""Speed of the gripper above which the fault is injected in a motion, in an approach [m/s]."""
OBSERVATION_TIME = 1.0
"""Time for which a repaired cell is observed before the operator acts [s]."""
BRAKING_TIME_LIMIT = 0.15
"""Time within which braking must begin [s]."""
SETTLING_TIME, SETTLING_TOLERANCE = 0.05, 2e-3
"""Time after coming to rest before the drift is measured [s], and angle by which a joint at rest
may settle [rad]."""
SERVO_POINT_DURATION = 0.032
"""Motion of one servo point that is in flight [s]."""
GATEWAY_TIMEOUT, RESTART_TIMEOUT = 10.0, 60.0
"""Time limits for the gateway to publish its state, and for a process to be restarted [s]."""

Phase = Literal["moving", "approaching", "disarmed", "armed", "held", "reached"]
"""Phase of operation in which a fault is injected: a motion; an approach, whose button stays held;
disarmed; armed, without a run; held by a person in the middle of a run; after the goal has been
reached."""
RESTING_PHASES: tuple[Phase, ...] = ("disarmed", "armed", "held", "reached")
"""Phases in which the arm rests."""
RESUMPTION_WORDS = {
    "by itself": "by itself",
    "after acknowledgement": "acknowledged",
    "after arming": "armed",
}
"""Start of what `_resume` returns, for each way of resuming in the table of stop causes."""


def run_trial(
    cell: FaultCell, name: str, phase: Phase = "moving", seconds: float | None = None
) -> dict[str, Any]:
    """Inject one fault, repair it after `seconds` (None: of the case), resume, reach the goal.

    Returns `cause` and `reason` of the gateway, empty without a stop; times from the effect until
    the gateway reported it (`noticed_s`), until the joints decelerated (`braking_s`) and until they
    were at rest (`rest_s`), by the arm's log; `drift_rad`, largest motion of a joint between rest,
    or the injection where the arm rests, and the operator's consent; how it `resumed`; whether it
    `reached` its goal; number of `further_holds` on the way there, for other reasons; `ok` if every
    promise of docs/concepts/safety.md was kept, else the `failure`.
    """
    case = CASES[name]
    try:
        _enter(cell, phase)
    except (DeadlineMissed, RequestFailed) as error:
        # An overloaded machine stops the cell too; the operator acknowledges and tries again.
        print(f"{name}: {error}; trying again", file=sys.stderr)
        cell.release_approach_button()
        cell.update()
        if cell.arms.needs_acknowledgement or cell.arms.needs_resume:
            cell.acknowledge()
        if phase in ("moving", "held"):
            # From where it was held the arm may be too near to an end to become fast.
            cell.go_to_goal()
        _enter(cell, phase)
    cell.states.clear()
    begun = cell.now()
    effect = case.inject(cell) or begun + case.effect
    observe(cell, effect + (seconds or case.duration))
    states = list(cell.states)
    ended = cell.now()
    if case.stack_ends:
        cell.release_approach_button()
        cell.end_stack()
    if case.repair:
        case.repair(cell)
    observe(cell, cell.now() + OBSERVATION_TIME)
    states += [s for s in cell.states if s not in states[-1:]]
    approached = phase == "approaching" and cell.arms.may_move
    if phase == "approaching":
        cell.release_approach_button()
        observe(cell, cell.now() + OBSERVATION_TIME)
    cause, noticed, reason = _reported_cause(states, effect, case.causes)
    if case.routed:
        # What the gateway said reaches nobody before there is another router.
        noticed = None
    if cause and (case.keeps_up or cause == "new_writer"):
        # The arm need not stop before: an approach goes on without a controller until another one
        # speaks.
        effect += noticed or 0.0
    resumed, reached, failure, further_holds = "", False, "", 0
    consent = cell.now()
    try:
        for process in case.restarted:
            cell.wait_until(
                lambda p=process: cell.process_state(p) == "ready", RESTART_TIMEOUT, f"no {process}"
            )
        consent = cell.now()
        resumed = _resume(cell)
        if cell.task.state != RUNNING:
            cell.start_motion(new_goal=phase in ("disarmed", "armed", "reached"))
        further_holds = cell.wait_until_reached()
        reached = True
    except (DeadlineMissed, RequestFailed) as error:
        failure = str(error)
    log = cell.joint_log()
    braking = rest = None
    drift = 0.0
    if phase in RESTING_PHASES:
        drift = log.moved(begun, consent)
    elif cause:
        braking, rest = log.braking_after(effect, ended), log.rest_after(effect, ended)
        if rest is not None and resumed != "by itself" and not approached:
            drift = log.moved(effect + rest + SETTLING_TIME, consent)
    result: dict[str, Any] = {
        "case": name,
        "phase": phase,
        "cause": cause,
        "reason": reason,
        "noticed_s": noticed,
        "braking_s": braking,
        "rest_s": rest,
        "drift_rad": drift,
        "resumed": resumed,
        "reached": reached,
        "further_holds": further_holds,
    }
    failures = [failure] if failure else []
    failures += _broken_promises(result, cell.scenario.limits.joint_speed)
    return {**result, "ok": not failures, "failure": "; ".join(failures)}


def _broken_promises(result: Mapping[str, Any], joint_speed: float) -> Iterator[str]:
    """Yield the promises of docs/concepts/safety.md that a trial breaks."""
    case, cause, drift = CASES[result["case"]], result["cause"], result["drift_rad"]
    if result["phase"] in RESTING_PHASES:
        if drift > SETTLING_TOLERANCE:
            yield f"a joint of the resting arm moved by {drift:.4f} rad before the operator agreed"
        return
    # An approach needs neither controller nor camera.
    moving = result["phase"] == "moving"
    if moving and cause not in (case.causes or ("",)):
        yield f"cause {cause or 'none'} instead of {' or '.join(case.causes) or 'none'}"
    if case.promised and (result["braking_s"] or 0.0) > BRAKING_TIME_LIMIT:
        yield f"braking began after {1e3 * result['braking_s']:.0f} ms"
    in_flight = SERVO_POINT_DURATION * joint_speed if case.point_in_flight else 0.0
    if drift > in_flight + SETTLING_TOLERANCE:
        yield f"a joint moved by {drift:.4f} rad before the operator agreed"
    way = STOP_CAUSES[cause].resumes if moving and cause in STOP_CAUSES else None
    if way and not result["resumed"].startswith(RESUMPTION_WORDS[way]):
        yield f"resumed {result['resumed']} instead of {way}"


def _enter(cell: FaultCell, phase: Phase) -> None:
    """Bring an armed cell into a phase of operation."""
    match phase:
        case "approaching":
            cell.go_to_goal()
            cell.end_run()
            cell.disarm()
            cell.hold_approach_button()
            cell.wait_until_fast(APPROACH_SPEED)
        case "moving" | "held" | "reached":
            cell.start_motion()
            if phase == "reached":
                cell.wait_until_reached()
            else:
                cell.wait_until_fast(INJECTION_SPEED)
            if phase == "held":
                cell.hold()
        case "armed" | "disarmed":
            cell.end_run()
            if phase == "disarmed":
                cell.disarm()
    if phase in RESTING_PHASES:
        observe(cell, cell.now() + OBSERVATION_TIME)


def observe(cell: FaultCell, end: float) -> None:
    """Take messages until a time [s]."""
    while cell.now() < end:
        cell.update()
        time.sleep(POLL_PERIOD)


def _reported_cause(
    states: list[ArmStates], effect: float, causes: tuple[str, ...]
) -> tuple[str, float | None, str]:
    """Return the first stop cause that the gateway reported, its delay [s], and its reason."""
    stops = [s for s in states if s.cause]
    chosen = [s for s in stops if s.cause in causes] or stops
    if not chosen:
        return "", None, ""
    first = chosen[0]
    return first.cause, max(1e-9 * first.stamp - effect, 0.0), first.reason


def _resume(cell: FaultCell) -> str:
    """Arm or acknowledge as needed after the repair; return the way in which the cell resumed."""
    cell.states.clear()
    cell.wait_until(lambda: bool(cell.states), GATEWAY_TIMEOUT, "the gateway publishes nothing")
    if cell.arms.mode == ArmStates.DISARMED:
        cell.wait_until_connected()
        return cell.arm()
    if cell.arms.needs_acknowledgement:
        cell.wait_until_connected()
        cell.acknowledge()
        return "acknowledged"
    if cell.arms.needs_approach:
        cell.arm()
        return "approached"
    return "by itself"

"""One fault in the middle of a motion, from setting out to reaching the goal after all."""

from __future__ import annotations

import sys
import time
from dataclasses import dataclass

from benchmarks.faults.cases import CASES
from benchmarks.faults.cell import TICK, FaultCell, Missing
from benchmarks.faults.motion import JointLog
from services.robot_gateway.safety.stop_causes import STOP_CAUSES
from shared.messages import RUNNING, ArmStates
from stack.client import RequestFailed

FAST = 0.1
"""Speed of the gripper from which a fault comes [m/s]."""
QUIET = 1.0
"""For which a healed cell is watched before a person does anything [s]."""
PROMISE = 0.15
"""Within which braking must have begun [s]."""
STILL = 2e-3
"""Angle by which a joint that rests may still settle [rad]."""
UNDER_WAY = 0.032
"""Motion that one servo point holds, where it still reaches the arm [s]."""


@dataclass(frozen=True)
class Finding:
    """What one fault led to."""

    case: str
    what: str
    cause: str
    """Named by the gateway."""
    reason: str
    """In its words."""
    noticed_s: float | None
    """From the effect until the gateway said so."""
    braking_s: float | None
    """From the effect until the joints were slower than ever after it, by the arm's own log."""
    rest_s: float | None
    """From the effect until they rested."""
    crept_rad: float
    """By which a joint moved between rest and the person's word."""
    resumed: str
    """What it took."""
    reached: bool
    held_again: int
    """How often it held for other reasons on the way to the goal."""
    ok: bool
    """Whether all that docs/safety.md promises held."""
    trouble: str
    """What did not."""


def trial(cell: FaultCell, name: str) -> Finding:
    """Injects one fault and sees it through."""
    case = CASES[name]
    try:
        cell.set_out()
        cell.until_fast(FAST)
    except (Missing, RequestFailed) as missing:
        # A machine that is too busy stops the cell too; a person looks, and goes on.
        print(f"{name}: {missing}; once more", file=sys.stderr)
        cell.look()
        if cell.arms.needs_acknowledgement:
            cell.acknowledge()
        cell.set_out()
        cell.until_fast(FAST)
    cell.states.clear()
    begun = cell.now()
    case.inject(cell)
    effect = begun + case.effect
    watch(cell, effect + case.lasts)
    states = list(cell.states)
    if case.stack_ends:
        cell.leave()
    ended = cell.now()
    if case.heal:
        case.heal(cell)
    healed, heard = cell.now(), len(cell.states)
    watch(cell, healed + QUIET)
    if case.routed:
        # This one, too, must find the router again.
        cell.until(lambda: len(cell.states) > heard, 10.0, "the gateway says nothing")
    states += [s for s in cell.states if s not in states[-1:]]
    cause, noticed, reason = _named(states, effect, case.causes)
    resumed, reached, trouble, held_again = "", False, "", 0
    asked = cell.now()
    try:
        for process in case.revives:
            cell.until(lambda p=process: cell.process_state(p) == "ready", 60.0, f"no {process}")
        asked = cell.now()
        resumed = _go_on(cell)
        if cell.task_state is None or cell.task_state.state != RUNNING:
            cell.set_out(other=False)
        held_again = cell.until_reached()
        reached = True
    except (Missing, RequestFailed) as missing:
        trouble = str(missing)
    joints = cell.joints()
    braking = joints.braking_after(effect, ended) if cause else None
    rest = joints.rest_after(effect, ended) if cause else None
    crept = _crept(joints, effect, rest, asked) if resumed != "by itself" else 0.0
    complaints = [trouble] if trouble else []
    if cause not in (case.causes or ("",)):
        complaints.append(
            f"named {cause or 'nothing'}, not {' or '.join(case.causes) or 'nothing'}"
        )
    if case.promised and braking is not None and braking > PROMISE:
        complaints.append(f"braking began after {1e3 * braking:.0f} ms")
    under_way = UNDER_WAY * cell.scenario.limits.joint_speed if case.delivers else 0.0
    if crept > under_way + STILL:
        complaints.append(f"a joint moved by {crept:.4f} rad before anybody agreed")
    if cause in STOP_CAUSES and not resumed.startswith(WORDS[STOP_CAUSES[cause].resumes]):
        complaints.append(f"resumed {resumed}, not {STOP_CAUSES[cause].resumes}")
    return Finding(
        case=name,
        what=case.what,
        cause=cause,
        reason=reason,
        noticed_s=noticed,
        braking_s=braking,
        rest_s=rest,
        crept_rad=crept,
        resumed=resumed,
        reached=reached,
        held_again=held_again,
        ok=not complaints,
        trouble="; ".join(complaints),
    )


WORDS = {"by itself": "by itself", "after acknowledgement": "acknowledged", "after arming": "armed"}
"""How a row of the table resumes, as `_go_on` says it."""


def watch(cell: FaultCell, end: float) -> None:
    """Listens until a time [s]."""
    while cell.now() < end:
        cell.look()
        time.sleep(TICK)


def _named(
    states: list[ArmStates], effect: float, causes: tuple[str, ...]
) -> tuple[str, float | None, str]:
    """The cause that the gateway gave first, when [s] after the effect, and its words."""
    stopped = [s for s in states if s.cause]
    chosen = [s for s in stopped if s.cause in causes] or stopped
    if not chosen:
        return "", None, ""
    first = chosen[0]
    return first.cause, max(1e-9 * first.stamp - effect, 0.0), first.reason


def _go_on(cell: FaultCell) -> str:
    """What a person does, once everything is whole, and how that is called."""
    cell.states.clear()
    cell.until(lambda: bool(cell.states), 10.0, "the gateway says nothing")
    if cell.arms.mode == ArmStates.DISARMED:
        cell.until(lambda: cell.heard, 20.0, "the arm is not heard")
        return cell.arm()
    if cell.arms.needs_acknowledgement:
        cell.until(lambda: cell.heard, 20.0, "the arm is not heard")
        cell.acknowledge()
        return "acknowledged"
    return "by itself"


def _crept(joints: JointLog, effect: float, rest: float | None, asked: float) -> float:
    return joints.moved(effect + rest + 0.05, asked) if rest is not None else 0.0

"""Steps of the checklist at which an arm moves, each after a person has agreed to it."""

from __future__ import annotations

import numpy as np

from lariat.scenario import Scenario, Shape
from shared import topics
from shared.messages import FAILED, REACHED, ArmCommand, ArmStates, TaskRequest, TaskState
from stack.commissioning.checks import newest
from stack.commissioning.session import NotPassed, Session

READY_TIMEOUT = 60.0
"""Longest time until an arm has power and is ready [s]."""
RUN_TIMEOUT = 180.0
"""Longest duration of a slow run [s]."""
DRILL_SPEED = 0.3
"""Share of the speed limit at which the stop drill begins [-]."""
STILL_SPEED = 1e-3
"""Speed of a grip below which it rests [m/s]."""
REACTION_TIME = 0.3
"""Time from a stop's command until braking that is allowed: bus, gateway and the arm's lag [s]."""
POWER_OFF_TIMEOUT = 15.0
"""Longest time from disarming until the arms report that they are off [s]."""


def arming(session: Session) -> str:
    """Give the arms power; they stand still."""
    state = newest(session)
    if state.may_move:
        return "armed already"
    if state.needs_acknowledgement:
        raise NotPassed(f"the cell holds: {state.reason}; acknowledge it (lariat ack) when cured")
    if state.needs_approach:
        return "given by the way to the start"
    session.agree_to_motion("Arming gives power and releases the brakes.")
    return _armed(session)


def start(session: Session) -> str:
    """Bring the arms to the start while a person holds a key."""
    state = newest(session)
    if state.may_move:
        return "at the start already"
    distance = 1e3 * state.approach_distance
    session.agree_to_motion(
        f"The arms go {distance:.0f} mm in a straight line to the start, at 50 mm/s at most, while "
        f"you hold {session.operator.approach_button} down."
    )
    ended = session.operator.approach(session.link, newest(session))
    if ended:
        raise NotPassed(f"the approach ended: {ended}; run this step again")
    return f"{distance:.0f} mm gone"


def rope_expected(scenario: Scenario) -> str:
    """Return why the cell cannot run without a rope; empty when it can."""
    if not scenario.sensing.outside:
        return ""
    return (
        "the camera looks for a real rope; set sensing.outside = false, start the stack and "
        "commission again for the run without one"
    )


def rope_simulated(scenario: Scenario) -> str:
    """Return why the cell cannot run with a rope; empty when it can."""
    if scenario.sensing.outside:
        return ""
    return (
        "the rope is simulated; set sensing.outside = true, start the stack and the camera, and "
        "commission again for the run with a real one"
    )


def run_without_rope(session: Session) -> str:
    """Run slowly to the goal and back, with nothing in the grippers."""
    session.confirm("Are the grippers empty?", "take the rope out of the grippers")
    return _there_and_back(session, "The arms run slowly to the goal, without a rope, and back.")


def run_with_rope(session: Session) -> str:
    """Run slowly to the goal and back, with the rope."""
    session.confirm("Do the grippers hold the rope at its ends?", "put the rope into the grippers")
    return _there_and_back(session, "The arms run slowly to the goal, with the rope, and back.")


def stop_drill(session: Session) -> str:
    """Hold the arms in the middle of a motion, and measure the time until they rest."""
    session.agree_to_motion("The arms move, and are held by the software in the middle of it.")
    _ensure_armed(session)
    session.link.set_goal(session.scenario.goal)
    session.link.request(TaskRequest.START)
    limits = session.scenario.limits
    moving = session.link.observe(
        lambda state: max_speed(state) > DRILL_SPEED * limits.speed, READY_TIMEOUT
    )
    if not moving or max_speed(moving[-1]) <= DRILL_SPEED * limits.speed:
        raise NotPassed(f"the arms did not get to move: {_task_words(session)}")
    begun = session.link.command(ArmCommand.HOLD)
    allowed = REACTION_TIME + limits.speed / limits.acceleration
    allowed += limits.acceleration / limits.jerk
    states = session.link.observe(lambda state: max_speed(state) < STILL_SPEED, 4.0 * allowed)
    took = 1e-9 * (states[-1].stamp - begun.stamp) if states else 4.0 * allowed
    session.link.request(TaskRequest.STOP)
    if took > allowed or max_speed(states[-1]) >= STILL_SPEED:
        raise NotPassed(
            f"the arms rested {took:.2f} s after the hold, {allowed:.2f} s are allowed; "
            "do not go on"
        )
    session.confirm("Did the arms stop at once and without a jolt?", "the stop was not confirmed")
    return f"at rest {took:.2f} s after the hold ({allowed:.2f} s allowed)"


def power_off(session: Session) -> str:
    """Take the power, and wait until every arm reports it."""
    session.link.command(ArmCommand.DISARM)
    states = session.link.observe(
        lambda state: not any(arm.powered for arm in state.arms), POWER_OFF_TIMEOUT
    )
    if not states or any(arm.powered for arm in states[-1].arms):
        on = [arm.arm for arm in states[-1].arms if arm.powered] if states else ["unknown"]
        raise NotPassed(f"still powered: {', '.join(on)}; take the power at the arm itself")
    return "all arms report that they are off"


def max_speed(state: ArmStates) -> float:
    """Return the largest speed of a grip [m/s]."""
    return max((float(np.linalg.norm(arm.linear_velocity)) for arm in state.arms), default=0.0)


def _there_and_back(session: Session, question: str) -> str:
    session.agree_to_motion(question)
    _ensure_armed(session)
    fastest = _run_to(session, session.scenario.goal)
    session.agree_to_motion("The goal is reached. The arms run back to the start.")
    fastest = max(fastest, _run_to(session, session.scenario.start))
    return f"goal and start reached, largest speed {1e3 * fastest:.0f} mm/s"


def _run_to(session: Session, shape: Shape) -> float:
    """Run to a shape; the largest speed of a grip on the way [m/s]."""
    session.link.set_goal(shape)
    session.link.request(TaskRequest.START)

    def ended(state: ArmStates) -> bool:
        task = session.link.latest(topics.TASK_STATE) or TaskState()
        return task.state in (REACHED, FAILED) or state.needs_acknowledgement

    states = session.link.observe(ended, RUN_TIMEOUT)
    task = session.link.latest(topics.TASK_STATE) or TaskState()
    session.link.request(TaskRequest.STOP)
    if task.state != REACHED:
        raise NotPassed(f"the run has not reached its goal: {_words(task, states)}")
    return max(max_speed(state) for state in states)


def _armed(session: Session) -> str:
    """Arm, and wait until the arms are ready."""
    session.link.command(ArmCommand.ARM)
    states = session.link.observe(lambda state: state.may_move, READY_TIMEOUT)
    if not states or not states[-1].may_move:
        reason = states[-1].reason if states else "the robot gateway is silent"
        raise NotPassed(f"the arms are not ready: {reason}")
    return "armed and ready"


def _ensure_armed(session: Session) -> None:
    """Acknowledge and resume a hold that a stop has left; the person has just agreed to move."""
    state = newest(session)
    if state.needs_acknowledgement:
        session.link.command(ArmCommand.ACKNOWLEDGE)
        states = session.link.observe(lambda state: state.needs_resume, READY_TIMEOUT)
        state = states[-1] if states else state
    if state.needs_resume:
        session.link.command(ArmCommand.RESUME)
        states = session.link.observe(lambda state: state.may_move, READY_TIMEOUT)
        state = states[-1] if states else state
    if not state.may_move:
        raise NotPassed(f"the arms cannot move: {state.reason}")


def _task_words(session: Session) -> str:
    return (session.link.latest(topics.TASK_STATE) or TaskState()).reason


def _words(task: TaskState, states: list[ArmStates]) -> str:
    arms = states[-1].reason if states and states[-1].needs_acknowledgement else ""
    return arms or task.reason

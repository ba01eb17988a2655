"""Steps of the checklist at which nothing moves."""

from __future__ import annotations

from lariat.scenario import SIDES, Scenario
from shared import topics
from shared.messages import ArmState, ArmStates
from shared.version import version
from stack import preflight
from stack.commissioning.session import NotPassed, Session

FIRST_DAY_SPEED = 0.05
"""Largest speed of a grip on the first day [m/s]."""
FIRST_DAY_ANGULAR_SPEED = 0.2
"""Largest angular speed of a grip on the first day [rad/s]."""
FIRST_DAY_JOINT_SPEED = 0.5
"""Largest speed of a joint on the first day [rad/s]."""
LISTENING_TIME = 3.0
"""Time for which the stack is listened to [s]."""
MIN_LINK_RATE = 100.0
"""Rate that a real arm's feedback must reach within `LISTENING_TIME` [Hz]."""
REQUIRED_SERVICES = ("perception", "planner", "controller", "robot_gateway")
"""Services that must run."""


def scenario(session: Session) -> str:
    """Check the cell's file with the rod."""
    reports = preflight.check(session.scenario)
    worst = min(reports.values(), key=lambda report: report.clearance)
    near = f", nearest {worst.nearest}" if worst.nearest else ""
    return f"start and goal are clear by {1e3 * worst.clearance:.0f} mm{near}"


def limits(session: Session) -> str:
    """Check that the cell moves slowly."""
    found = session.scenario.limits
    bounds = {
        "speed": FIRST_DAY_SPEED,
        "angular_speed": FIRST_DAY_ANGULAR_SPEED,
        "joint_speed": FIRST_DAY_JOINT_SPEED,
    }
    high = [f"{key} = {bound:g}" for key, bound in bounds.items() if getattr(found, key) > bound]
    if high:
        raise NotPassed(
            f"the cell is too fast for a first day; write {', '.join(high)} in [limits], and start "
            "the stack again"
        )
    return f"speed {found.speed:g} m/s, joint speed {found.joint_speed:g} rad/s"


def processes(session: Session) -> str:
    """Check that every process runs, with this version, and notes no problem.

    While the arms are away from the start, notes about the rope or the grips say nothing yet.
    """
    states = session.link.observe(lambda _: False, LISTENING_TIME)
    away = bool(states) and states[-1].needs_approach
    noted = ""
    for name in REQUIRED_SERVICES:
        health = session.link.latest(topics.HEALTH.at(name))
        if health is None:
            raise NotPassed(f"{name} is not heard; is the stack of this cell running (lariat up)?")
        if health.version != version():
            raise NotPassed(
                f"{name} is version {health.version}, this is {version()}; start the stack again"
            )
        if health.note and not away:
            raise NotPassed(f"{name}: {health.note}")
        noted += f"; {name}, before the way to the start: {health.note}" if health.note else ""
    return f"version {version()}{noted}"


def arms(session: Session) -> str:
    """Check that every arm answers, stands without power and reports no alarm."""
    states = session.link.observe(lambda _: False, LISTENING_TIME) or [newest(session)]
    state = states[-1]
    words = []
    for arm in _driven(session, state):
        end = session.scenario.end("left" if arm.arm == "left" else "right")
        if arm.driver != end.driver:
            raise NotPassed(
                f"{arm.arm} is driven as {arm.driver!r}, the file says {end.driver!r}; start the "
                "stack with this file"
            )
        if arm.alarms:
            raise NotPassed(f"{arm.arm}: {'; '.join(arm.alarms)}")
        if not arm.position:
            raise NotPassed(f"{arm.arm}: its pose is not known; is it on, at {end.address!r}?")
        rates = [a.link_rate for past in states for a in past.arms if a.arm == arm.arm]
        if end.address and max(rates) < MIN_LINK_RATE and arm.driver == "cr5":
            raise NotPassed(
                f"{arm.arm}: feedback at {max(rates):.0f} Hz at most, {MIN_LINK_RATE:g} Hz are "
                "needed; look at the line, and at what else this computer does"
            )
        words.append(f"{arm.arm} ({arm.driver}{', ' + end.address if end.address else ''})")
    if state.mode != ArmStates.DISARMED and any(session.scenario.end(s).address for s in SIDES):
        raise NotPassed("the cell is armed; disarm it first (lariat disarm)")
    session.confirm(
        "Compare pose and joints at the pendant with `lariat status`. Do they agree?",
        "the poses differ; correct base_position, base_orientation or the tool in [ends]",
    )
    return ", ".join(words)


def load(session: Session) -> str:
    """Have a person compare load and tool of every arm."""
    words = []
    for side in SIDES:
        end = session.scenario.end(side)
        if end.driver in ("fixed", "ideal"):
            continue
        found = (
            f"{side}: load {end.load:g} kg at {list(end.load_center)} m, grip at "
            f"{list(end.tool_position)} m from the flange"
        )
        session.confirm(
            f"{found}. Weighed and measured?", f"measure and correct [ends.{side}] of the file"
        )
        words.append(found)
    return "; ".join(words)


def no_real_arm(scenario: Scenario) -> str:
    """Return why the emergency stop cannot be tried; empty when it can."""
    real = any(scenario.end(side).address for side in SIDES)
    return "" if real else "no arm of this cell is real"


def no_camera(scenario: Scenario) -> str:
    """Return why there is no camera to check; empty when there is one."""
    outside = scenario.sensing.source == "camera" and scenario.sensing.outside
    return "" if outside else "the rope is simulated: no camera of the cell is used"


def emergency_stop(session: Session) -> str:
    """Have a person press the hard-wired emergency stop, and watch the arms report it."""
    session.operator.tell("Press the emergency stop now, and leave it pressed.")
    states = session.link.observe(lambda state: any(arm.alarms for arm in state.arms), 60.0)
    alarms = [alarm for arm in states[-1].arms for alarm in arm.alarms] if states else []
    if not alarms:
        raise NotPassed("no arm has reported a stop within 60 s; look at the wiring")
    session.confirm(
        f"The arm reports: {'; '.join(alarms)}. Was it the emergency stop, and is it released?",
        "the stop was not confirmed",
    )
    return "; ".join(alarms)


def camera(session: Session) -> str:
    """Check that the rope is seen, and that the pose of every camera was calibrated."""
    for setup in session.scenario.camera_setups:
        if not setup.calibrated:
            raise NotPassed(
                f"{setup.key}.orientation is missing; calibrate the camera (lariat calibrate)"
            )
    session.link.observe(lambda _: False, 1.0)
    rope = session.link.latest(topics.ROPE_NODES)
    if rope is None:
        raise NotPassed("perception publishes nothing; is the camera's process running?")
    if not rope.positions:
        raise NotPassed(f"the rope is not seen: {rope.lost}")
    seen = sum(rope.observed) / len(rope.observed)
    session.confirm(
        "Do rope and grippers on the page lie where they are in the image, within a few mm?",
        "calibrate the camera again (lariat calibrate)",
    )
    return f"{100 * seen:.0f} % of the rope seen"


def newest(session: Session) -> ArmStates:
    """Return the state of the arms.

    Raises:
        NotPassed: The gateway publishes none.
    """
    states = session.link.observe(lambda _: True, LISTENING_TIME)
    if not states:
        raise NotPassed("the robot gateway is not heard; is the stack running (lariat up)?")
    return states[-1]


def _driven(session: Session, state: ArmStates) -> list[ArmState]:
    fixed = {side for side in SIDES if session.scenario.end(side).driver == "fixed"}
    return [arm for arm in state.arms if arm.arm not in fixed]

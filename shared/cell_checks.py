"""Checks of a running cell, from what it publishes: the same at the terminal and on the page.

Nothing is commanded here. A person arms, approaches, runs and holds by the usual means; the checks
say what has been seen of it, what is wrong, and what nobody has tried yet.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from lariat.scenario import SIDES, Scenario
from lariat.trajectory import SECOND
from shared.messages import REACHED, ArmState, ArmStates, Health, NodeChain, TaskState
from shared.version import version

FIRST_DAY_LIMITS = {"speed": 0.05, "angular_speed": 0.2, "joint_speed": 0.5}
"""Largest limits of a first day [m/s], [rad/s], [rad/s]."""
MIN_LINK_RATE = 100.0
"""Rate that a real CR5's feedback must reach [Hz]."""
REQUIRED_SERVICES = ("perception", "planner", "controller", "robot_gateway")
"""Services that must run."""
DRILL_SPEED = 0.3
"""Share of the speed limit above which a stop counts as one in motion [-]."""
STILL_SPEED = 1e-3
"""Speed of a grip below which it rests [m/s]."""
REACTION_TIME = 0.3
"""Time from a stop's command until braking that is allowed: bus, gateway and the arm's lag [s]."""

Outcome = Literal["passed", "failed", "open"]
"""Outcome of a check; one is open that a person has yet to try or to compare."""


@dataclass(frozen=True)
class CheckResult:
    """Result of one check."""

    title: str
    """What is checked."""
    outcome: Outcome
    detail: str
    """What was found, and what to do."""


class CellChecks:
    """Checks of one cell, and what has been seen of it since they began to listen."""

    def __init__(self, scenario: Scenario) -> None:
        self._scenario = scenario
        self._ends = {side: scenario.end(side) for side in SIDES}
        self._health: dict[str, Health] = {}
        self._arms: ArmStates | None = None
        self._rope: NodeChain | None = None
        self._reached = False
        self._alarms: list[str] = []
        self._rates: dict[str, float] = {}
        self._stopping_since: int | None = None
        self._stop_time: float | None = None

    def take_health(self, service: str, health: Health) -> None:
        """Take the health of a service."""
        self._health[service] = health

    def take_rope(self, rope: NodeChain) -> None:
        """Take the observed rope."""
        self._rope = rope

    def take_task(self, task: TaskState) -> None:
        """Take a state of the run."""
        self._reached |= task.state == REACHED

    def take_arms(self, state: ArmStates) -> None:
        """Take a state of the arms; all of them, or a stop is measured too long."""
        before, self._arms = self._arms, state
        for arm in state.arms:
            self._rates[arm.arm] = max(self._rates.get(arm.arm, 0.0), arm.link_rate)
            self._alarms += [text for text in arm.alarms if text not in self._alarms]
        speed = max_speed(state)
        holds = state.mode in (ArmStates.HOLDING, ArmStates.FAULT, ArmStates.DISARMED)
        if before is not None and holds and before.mode == ArmStates.MOVING:
            fast = max_speed(before) > DRILL_SPEED * self._scenario.limits.speed
            self._stopping_since = state.stamp if fast else None
        if self._stopping_since is not None and speed < STILL_SPEED:
            self._stop_time = (state.stamp - self._stopping_since) / SECOND
            self._stopping_since = None

    def results(self) -> tuple[CheckResult, ...]:
        """Return the results of all checks, in the order of a first day."""
        return tuple(self._results())

    def _results(self) -> Iterator[CheckResult]:
        yield CheckResult("Limits of a first day", *self._limits())
        yield CheckResult("Processes and versions", *self._processes())
        yield CheckResult("Arms answer", *self._arms_answer())
        yield CheckResult("Load and tool", *self._load())
        if not self._scenario.simulated:
            yield CheckResult("Emergency stop", *self._emergency_stop())
        if self._scenario.sensing.source == "camera" and self._scenario.sensing.outside:
            yield CheckResult("Camera", *self._camera())
        yield CheckResult("Way to the start", *self._start())
        yield CheckResult("Run to the goal", *self._run())
        yield CheckResult("Stop in motion", *self._stop())
        yield CheckResult("Power off", *self._power_off())

    def _limits(self) -> tuple[Outcome, str]:
        limits = self._scenario.limits
        high = [f"{k} = {v:g}" for k, v in FIRST_DAY_LIMITS.items() if getattr(limits, k) > v]
        if high:
            return "open", f"for a first day write {', '.join(high)} in [limits]"
        return "passed", f"speed {limits.speed:g} m/s, joint speed {limits.joint_speed:g} rad/s"

    def _processes(self) -> tuple[Outcome, str]:
        away = self._arms is not None and self._arms.needs_approach
        noted = []
        for name in REQUIRED_SERVICES:
            health = self._health.get(name)
            if health is None:
                return (
                    "failed",
                    f"{name} is not heard; is the stack of this cell running (lariat up)?",
                )
            if health.version != version():
                return "failed", (
                    f"{name} is version {health.version}, this is {version()}; start it again"
                )
            # Away from the start, notes about the rope or the grips say nothing yet.
            if health.note and not away:
                return "failed", f"{name}: {health.note}"
            noted += [f"{name}, before the way to the start: {health.note}"] if health.note else []
        return "passed", "; ".join([f"version {version()}", *noted])

    def _arms_answer(self) -> tuple[Outcome, str]:
        if self._arms is None:
            return "failed", "the robot gateway is not heard; is the stack running (lariat up)?"
        driven = [arm for arm in self._arms.arms if self._ends[_side(arm)].driver != "fixed"]
        for arm in driven:
            if fault := self._fault(arm):
                return "failed", f"{arm.arm}: {fault}"
        named = ", ".join(f"{arm.arm} ({arm.driver})" for arm in driven)
        if not self._scenario.simulated:
            return "open", f"{named}; compare pose and joints at the pendant with `lariat status`"
        return "passed", named

    def _fault(self, arm: ArmState) -> str:
        """Reason why an arm is not in order, with the way out; empty when it is."""
        end = self._ends[_side(arm)]
        if arm.driver != end.driver:
            return (
                f"driven as {arm.driver!r}, the file says {end.driver!r}; start the stack with it"
            )
        if arm.alarms:
            return "; ".join(arm.alarms)
        if not arm.position:
            return f"its pose is not known; is it on, at {end.address!r}?"
        rate = self._rates[arm.arm]
        if end.address and arm.driver == "cr5" and rate < MIN_LINK_RATE:
            return (
                f"feedback at {rate:.0f} Hz at most, {MIN_LINK_RATE:g} Hz are needed; look at the "
                "line, and at what else this computer does"
            )
        return ""

    def _load(self) -> tuple[Outcome, str]:
        words = [
            f"{side}: load {end.load:g} kg at {list(end.load_center)} m, grip at "
            f"{list(end.tool_position)} m from the flange"
            for side, end in self._ends.items()
            if end.driver not in ("fixed", "ideal")
        ]
        if not words:
            return "passed", "no end is held by an arm"
        return "open", f"{'; '.join(words)}; weigh and measure, and correct [ends]"

    def _emergency_stop(self) -> tuple[Outcome, str]:
        if self._alarms:
            return "passed", f"reported: {'; '.join(self._alarms)}; was it the emergency stop?"
        return "open", "press the emergency stop, and release it: the arm must report it"

    def _camera(self) -> tuple[Outcome, str]:
        for setup in self._scenario.camera_setups:
            if not setup.calibrated:
                return "failed", f"{setup.key}.orientation is missing; run lariat calibrate"
        if self._rope is None:
            return "failed", "perception publishes nothing; is the camera's process running?"
        if not self._rope.positions:
            return "failed", f"the rope is not seen: {self._rope.lost}"
        seen = sum(self._rope.observed) / len(self._rope.observed)
        return (
            "passed",
            f"{seen:.0%} of the rope seen; on the page it must lie where the image has it",
        )

    def _start(self) -> tuple[Outcome, str]:
        if self._arms is None:
            return "open", "the arms are not heard"
        if self._arms.needs_approach:
            distance = 1e3 * self._arms.approach_distance
            return "open", f"{distance:.0f} mm away; `lariat approach`, or the page's button"
        return "passed", "at the start, or on a run"

    def _run(self) -> tuple[Outcome, str]:
        rope = "with the rope" if self._scenario.sensing.outside else "without a real rope"
        return (
            ("passed", f"reached, {rope}") if self._reached else ("open", f"run it slowly, {rope}")
        )

    def _stop(self) -> tuple[Outcome, str]:
        limits = self._scenario.limits
        allowed = REACTION_TIME + limits.speed / limits.acceleration
        allowed += limits.acceleration / limits.jerk
        if self._stop_time is None:
            return "open", "hold the arms in the middle of a run"
        words = f"at rest {self._stop_time:.2f} s after the hold ({allowed:.2f} s allowed)"
        if self._stop_time > allowed:
            return "failed", f"{words}; do not go on"
        return "passed", words

    def _power_off(self) -> tuple[Outcome, str]:
        if self._arms is None:
            return "open", "the arms are not heard"
        powered = [arm.arm for arm in self._arms.arms if arm.powered]
        if not powered:
            return "passed", "all arms report that they are off"
        if self._arms.mode == ArmStates.DISARMED:
            return (
                "failed",
                f"disarmed and powered: {', '.join(powered)}; take the power at the arm",
            )
        return "open", f"powered: {', '.join(powered)}; `lariat disarm` takes the power"


def max_speed(state: ArmStates) -> float:
    """Return the largest speed of a grip [m/s]."""
    return max((float(np.linalg.norm(arm.linear_velocity)) for arm in state.arms), default=0.0)


def _side(arm: ArmState) -> Literal["left", "right"]:
    return "left" if arm.arm == "left" else "right"

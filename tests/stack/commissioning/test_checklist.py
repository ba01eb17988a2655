"""First day of a cell with an emulated CR5, in simulated time: checked, consented to, resumable."""

from __future__ import annotations

import itertools
import json
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from datetime import datetime
from pathlib import Path
from typing import Any

import pytest

from lariat.scenario import Scenario, Shape
from lariat.trajectory import SECOND
from shared import topics
from shared.messages import (
    ArmCommand,
    ArmState,
    ArmStates,
    Consent,
    GoalDraft,
    Health,
    TaskRequest,
    TaskState,
    grip,
)
from shared.topics import Topic
from shared.version import version
from stack import services
from stack.client import RequestFailed
from stack.commissioning import checks
from stack.commissioning.checklist import STEPS, go_through
from stack.commissioning.checks import REQUIRED_SERVICES
from stack.commissioning.motions import max_speed
from stack.commissioning.record import CommissioningRecord, record_path
from stack.commissioning.session import CellLink, NotPassed, Session
from stack.scenario_overrides import load_with
from stack.simulation.simulated_time import SimulatedStack, session_id
from tests.closed_loop.loop import SCENARIOS

SLOW = (
    "rope.node_count=12",
    "sensing.source=truth",
    "plant.model=rod",
    "obstacles=[]",
    "limits.speed=0.05",
    "limits.angular_speed=0.2",
    "limits.joint_speed=0.5",
    "ends.right.arm_automatically=false",
    "goal.line=[[-0.20, 0.0, 0.30], [0.12, -0.13, 0.28]]",
)
"""Goal 3 cm from the start, at the speed of a first day."""


class SimulatedLink:
    """Stack in simulated time behind the checklist's link."""

    def __init__(self, scenario: Scenario) -> None:
        self.scenario = scenario
        members = [services.build(n, scenario, session_id(n)) for n in services.NAMES]
        self.fastest = 0.0
        self.commands: list[Any] = []
        self.stack = SimulatedStack(members, [self._tap])
        self.stack.warm_up()
        self._ids = itertools.count()

    def _tap(self, delivery: Any) -> None:
        if delivery.key == topics.ARM_STATE.key:
            self.fastest = max(self.fastest, max_speed(delivery.parse()))

    def latest(self, topic: Topic) -> Any | None:
        if topic.key in {topics.HEALTH.at(name).key for name in REQUIRED_SERVICES}:
            return Health(version=version())
        return self.stack.latest(topic)

    def newest(self, topic: Topic) -> Any:
        """Newest message of a topic that has one."""
        message = self.stack.latest(topic)
        assert message is not None, topic.key
        return message

    def observe(self, until: Callable[[ArmStates], bool], seconds: float) -> list[ArmStates]:
        states: list[ArmStates] = []
        end = self.stack.now + round(seconds * SECOND)
        while self.stack.now < end:
            self.stack.advance_to(self.stack.now + 8_000_000)
            state = self.stack.latest(topics.ARM_STATE)
            if state is not None:
                states.append(state)
                if until(state):
                    break
        return states

    def command(self, action: Any, **fields: Any) -> ArmStates:
        self.observe(lambda _: True, 1.0)
        shown, command = self.newest(topics.ARM_STATE), f"command-{next(self._ids)}"
        self.commands.append(action)
        self.stack.send(
            topics.ARM_COMMAND,
            ArmCommand(
                id=command,
                stamp=self.stack.now,
                boot=shown.boot,
                answers=shown.stamp,
                session=shown.next_session,
                action=action,
                **fields,
            ),
        )
        states = self.observe(lambda state: state.last_command == command, 3.0)
        if states[-1].refusal:
            raise RequestFailed(f"refused: {states[-1].refusal}")
        return states[-1]

    def request(self, action: Any, **fields: Any) -> TaskState:
        request = f"request-{next(self._ids)}"
        self.commands.append(TaskRequest.Action.Name(action))
        self.stack.send(
            topics.TASK_REQUEST,
            TaskRequest(id=request, stamp=self.stack.now, action=action, **fields),
        )
        self.observe(lambda _: self.newest(topics.TASK_STATE).last_request == request, 3.0)
        state = self.newest(topics.TASK_STATE)
        if state.refusal:
            raise RequestFailed(f"refused: {state.refusal}")
        return state

    def set_goal(self, shape: Shape) -> None:
        left, right = self.scenario.grips(shape)
        draft = GoalDraft(id="draft", stamp=self.stack.now, left=grip(left), right=grip(right))
        self.stack.send(topics.TASK_GOAL_DRAFT, draft)
        self.observe(lambda _: False, 0.2)
        preview = self.newest(topics.TASK_GOAL_PREVIEW)
        assert preview.reachable, preview.reason
        self.request(TaskRequest.SET_GOAL, goal=preview.goal)


@dataclass
class Person:
    """Person who agrees to everything but the questions with one of these words."""

    refuses: tuple[str, ...] = ()
    lines: list[str] = field(default_factory=list)

    def tell(self, text: str) -> None:
        self.lines.append(text)

    approach_button = "the space bar"

    def begin(self, number: int) -> None:
        pass

    def agree(self, question: str) -> bool:
        self.lines.append(f"? {question}")
        return not any(word in question for word in self.refuses)

    def approach(self, link: CellLink, shown: ArmStates) -> str:
        assert isinstance(link, SimulatedLink)
        link.command(
            ArmCommand.APPROACH,
            approach_distance=shown.approach_distance,
            approach_angle=shown.approach_angle,
        )
        state = link.newest(topics.ARM_STATE)
        command = state.last_command
        for number in range(1, 3000):
            link.stack.send(
                topics.ARM_CONSENT,
                Consent(
                    command=command,
                    boot=state.boot,
                    sequence=number,
                    stamp=link.stack.now,
                    answers=state.stamp,
                ),
            )
            link.observe(lambda _: False, 0.02)
            state = link.newest(topics.ARM_STATE)
            if not state.approaching:
                break
        return "" if state.may_move else state.reason


def cell(*settings: str) -> Scenario:
    return load_with(SCENARIOS / "fixed-end.toml", (*SLOW, *settings))


def go(link: CellLink, person: Person, path: Path, scenario: Scenario) -> bool:
    session = Session(scenario, link, person)
    return go_through(session, CommissioningRecord(path), lambda: datetime(2026, 1, 2, 3, 4, 5))


def outcomes(path: Path) -> dict[str, str]:
    steps = json.loads(path.read_text())["steps"]
    return {name: step["outcome"] for name, step in steps.items()}


def test_an_emulated_cell_passes_its_first_day_and_is_not_asked_twice(tmp_path: Path):
    scenario, path = cell(), record_path(tmp_path / "cell.toml")
    assert path == tmp_path / "cell.commissioning.json"
    link, person = SimulatedLink(scenario), Person()
    assert go(link, person, path, scenario), person.lines
    found = outcomes(path)
    assert list(found) == [step.name for step in STEPS]
    simulated = {"emergency stop", "camera", "run with rope"}
    assert {name for name, outcome in found.items() if outcome != "passed"} == simulated
    # Rounding of the servo's points aside, the limit of the first day held.
    assert 0.01 < link.fastest < 1.1 * scenario.limits.speed
    drill = json.loads(path.read_text())["steps"]["stop drill"]["detail"]
    assert drill.startswith("at rest 0.")
    # The next session asks about nothing that has passed, and moves nothing for it.
    link.commands.clear()
    again = Person(refuses=("",))
    assert go(link, again, path, scenario)
    assert link.commands == []
    assert any("Slow run without a rope: passed on 2026-01-02" in line for line in again.lines)
    # A changed limit makes the runs due again, and nothing else that rests on other settings.
    slower = replace(scenario, limits=replace(scenario.limits, speed=0.04))
    asked = Person(refuses=("Are the grippers empty",))
    assert not go(link, asked, path, slower)
    assert outcomes(path)["run without rope"] == "failed"
    assert any("Load and tool: passed on" in line for line in asked.lines)


@pytest.mark.parametrize("refused", ["Arming gives power", "with `lariat status`"])
def test_nothing_is_commanded_that_the_person_does_not_agree_to(tmp_path: Path, refused: str):
    scenario, path = cell(), tmp_path / "results.json"
    link, person = SimulatedLink(scenario), Person(refuses=(refused,))
    assert not go(link, person, path, scenario)
    assert link.commands == []
    assert link.fastest < 1e-3
    assert list(outcomes(path).values())[-1] == "failed"


def test_a_fast_cell_is_sent_back_to_its_limits(tmp_path: Path):
    scenario, person = cell("limits.speed=0.3"), Person()
    path = tmp_path / "results.json"
    assert not go(SilentLink(), person, path, scenario)
    assert outcomes(path) == {"scenario": "passed", "limits": "failed"}
    assert "write speed = 0.05 in [limits]" in person.lines[-1]


class SilentLink:
    """Link to a stack that does not run."""

    def latest(self, topic: Topic) -> Any | None:
        return None

    def observe(self, until: Callable[[ArmStates], bool], seconds: float) -> list[ArmStates]:
        return []

    def command(self, action: Any) -> ArmStates:
        raise AssertionError("a stack that does not run was commanded")

    def request(self, action: Any) -> TaskState:
        raise AssertionError("a stack that does not run was sent a request")

    def set_goal(self, shape: Shape) -> None:
        raise AssertionError("a stack that does not run was sent a goal")


def test_a_stack_that_does_not_run_fails_by_name(tmp_path: Path):
    path, person = tmp_path / "results.json", Person()
    assert not go(SilentLink(), person, path, cell())
    assert outcomes(path)["processes"] == "failed"
    assert "perception is not heard" in person.lines[-1]


class NotedLink(SilentLink):
    """Link to a stack whose controller waits for the grips."""

    def __init__(self, away: bool) -> None:
        self.away = away

    def latest(self, topic: Topic) -> Health:
        waits = topic.key == topics.HEALTH.at("controller").key
        return Health(version=version(), note="waiting for the grips" if waits else "")

    def observe(self, until: Callable[[ArmStates], bool], seconds: float) -> list[ArmStates]:
        return [ArmStates(needs_approach=self.away)]


def test_a_problem_that_a_process_notes_counts_once_the_arms_are_at_the_start():
    session = Session(cell(), NotedLink(away=True), Person())
    assert "controller, before the way to the start: waiting for" in checks.processes(session)
    session = Session(cell(), NotedLink(away=False), Person())
    with pytest.raises(NotPassed, match="controller: waiting for the grips"):
        checks.processes(session)


class ArmLink(SilentLink):
    """Link to a stack whose real arm sends feedback at some rates, one after the other."""

    def __init__(self, *rates: float) -> None:
        arm = {"arm": "right", "driver": "cr5", "position": [0.0, 0.0, 0.3]}
        self.states = [
            ArmStates(mode=ArmStates.DISARMED, arms=[ArmState(**arm, link_rate=rate)])
            for rate in rates
        ]

    def observe(self, until: Callable[[ArmStates], bool], seconds: float) -> list[ArmStates]:
        return self.states


def test_an_arm_fails_by_a_line_that_is_never_fast_enough():
    real = cell("ends.right.address=192.0.2.7")
    assert "192.0.2.7" in checks.arms(Session(real, ArmLink(95.0, 124.0, 96.0), Person()))
    with pytest.raises(NotPassed, match="feedback at 60 Hz at most, 100 Hz are needed"):
        checks.arms(Session(real, ArmLink(55.0, 60.0), Person()))


def test_a_damaged_file_of_results_is_refused(tmp_path: Path):
    path = tmp_path / "results.json"
    path.write_text("[]")
    with pytest.raises(ValueError, match="move it away to begin anew"):
        CommissioningRecord(path)

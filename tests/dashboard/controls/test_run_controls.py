from __future__ import annotations

from collections.abc import Iterator

import pytest

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls.run_controls import NUMBERS_PERIOD, RunControls, next_step
from dashboard.controls.status_text import StatusLine
from dashboard.outbox import Outbox
from dashboard.web.private_viser import PrivateViser
from lariat.trajectory import SECOND
from shared.messages import (
    IDLE,
    PAUSED,
    RUNNING,
    ArmCommand,
    ArmStates,
    TaskRequest,
    TaskState,
)

NOW = 100 * SECOND
IDLE_TASK, RUNS, PAUSES = (TaskState(state=s) for s in (IDLE, RUNNING, PAUSED))
ARMED = ArmStates(mode=ArmStates.ARMED)
HELD = ArmStates(mode=ArmStates.HOLDING, needs_acknowledgement=True)
ACKNOWLEDGED = ArmStates(mode=ArmStates.HOLDING, needs_resume=True)


class Controls:
    """Run controls of a cell, with what they send."""

    def __init__(self, simulated: bool = True) -> None:
        self.private = PrivateViser("test")
        self.actions, self.outbox = ActionQueue(), Outbox("a")
        self.commands: list[str] = []
        self.panel = RunControls(
            self.private.server.gui,
            self.actions,
            self.outbox,
            live=True,
            simulated=simulated,
            command=lambda action, label: self.commands.append(ArmCommand.Action.Name(action)),
        )
        self.now = NOW

    def show(self, task: TaskState, arms: ArmStates, seconds: float = 2.0) -> list[str]:
        """Labels of the buttons that are shown for a state, some time later."""
        self.now += round(seconds * SECOND)
        self.panel.update(line("a"), task, arms, self.now)
        return [label for label, button in self.panel._buttons.items() if button.visible]

    def press(self, label: str) -> list[str]:
        """Press a button; names of all requests and commands so far."""
        self.panel._press(label)
        sent = self.outbox.take(self.now)
        return self.commands + [TaskRequest.Action.Name(p.message.action) for p in sent]


@pytest.fixture
def controls() -> Iterator[RunControls]:
    made = Controls()
    yield made.panel
    made.private.close()


@pytest.fixture(params=[True, False], ids=["simulated", "real"])
def cell(request: pytest.FixtureRequest) -> Iterator[Controls]:
    made = Controls(request.param)
    yield made
    made.private.close()


def line(text: str) -> StatusLine:
    return StatusLine(text, palette.BUSY)


def test_numbers_of_the_headline_change_at_a_readable_rate(controls: RunControls) -> None:
    now = 100 * NUMBERS_PERIOD
    controls.update(line("Running: 9 mm to go"), None, None, now)
    controls.update(line("Running: 8 mm to go"), None, None, now + NUMBERS_PERIOD // 2)
    assert "9 mm" in controls.headline.content
    controls.update(line("Running: 7 mm to go"), None, None, now + NUMBERS_PERIOD)
    assert "7 mm" in controls.headline.content
    # A jump back in a recording.
    controls.update(line("Running: 8 mm to go"), None, None, now)
    assert "8 mm" in controls.headline.content


def test_another_state_is_shown_at_once(controls: RunControls) -> None:
    now = 100 * NUMBERS_PERIOD
    controls.update(line("Running: 9 mm to go"), None, None, now)
    controls.update(line("Reached: 1 mm from the goal"), None, None, now + 1)
    assert "Reached" in controls.headline.content


@pytest.mark.parametrize(
    ("task", "arms", "simulated", "real"),
    [
        (None, ARMED, "", ""),
        (IDLE_TASK, ARMED, "Start", "Start"),
        (IDLE_TASK, ArmStates(mode=ArmStates.DISARMED), "Arm", "Arm"),
        (IDLE_TASK, ArmStates(mode=ArmStates.DISARMED, needs_approach=True), "", ""),
        (RUNS, ARMED, "", ""),
        (RUNS, HELD, "Continue", "Acknowledge"),
        (RUNS, ACKNOWLEDGED, "Continue", "Resume arms"),
        (PAUSES, ARMED, "Continue", "Continue"),
    ],
)
def test_one_next_step_is_offered(
    task: TaskState | None, arms: ArmStates, simulated: str, real: str
) -> None:
    assert next_step(task, arms, simulated=True) == simulated
    assert next_step(task, arms, simulated=False) == real


def test_only_the_next_step_is_shown_and_a_real_arm_needs_one_press_for_each(
    cell: Controls,
) -> None:
    simulated = cell.panel._simulated
    assert cell.show(PAUSES, HELD) == ["Continue" if simulated else "Acknowledge"]
    cell.show(PAUSES, HELD)
    assert cell.press(cell.panel._step) == ["ACKNOWLEDGE"]
    cell.show(PAUSES, ACKNOWLEDGED, seconds=0.1)
    if simulated:
        assert cell.commands == ["ACKNOWLEDGE", "RESUME"]
        cell.show(PAUSES, ARMED, seconds=0.1)
        assert [p.message.action for p in cell.outbox.take(0)] == [TaskRequest.START]
    else:
        # The second click of a double click.
        assert cell.press("Resume arms") == ["ACKNOWLEDGE"]
        cell.show(PAUSES, ACKNOWLEDGED)
        assert cell.press("Resume arms") == ["ACKNOWLEDGE", "RESUME"]
        cell.show(PAUSES, ARMED)
        assert not list(cell.outbox.take(0))


def test_continue_gives_up_where_the_arms_do_not_answer() -> None:
    cell = Controls()
    cell.show(RUNS, HELD)
    cell.press("Continue")
    cell.show(RUNS, HELD, seconds=4.0)
    # Somebody else acknowledges later.
    cell.show(RUNS, ACKNOWLEDGED)
    assert cell.commands == ["ACKNOWLEDGE"]
    cell.private.close()

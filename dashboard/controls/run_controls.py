"""Headline of the page, the one next step, and the buttons of the run."""

from __future__ import annotations

from collections.abc import Callable

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.status_text import StatusLine
from dashboard.outbox import Outbox
from lariat.trajectory import SECOND
from shared.messages import PAUSED, RUNNING, ArmCommand, ArmStates, TaskRequest, TaskState

CONTINUE = "Continue"
"""Next step after a pause; where no arm is real, also after a hold."""
STEPS = {
    "Acknowledge": (
        ArmCommand.ACKNOWLEDGE,
        viser.Icon.CHECK,
        palette.WARNING,
        "Confirm that you have looked at the cell; moves nothing",
    ),
    "Resume arms": (
        ArmCommand.RESUME,
        viser.Icon.PLAYER_TRACK_NEXT,
        palette.WARNING,
        "Allow acknowledged arms to move again: a run goes on at once",
    ),
    "Arm": (
        ArmCommand.ARM,
        viser.Icon.POWER,
        palette.BRAND,
        "Power the arms and allow them to move",
    ),
    CONTINUE: (None, viser.Icon.PLAYER_PLAY, palette.GOOD, "Go on with the run"),
    "Start": (None, viser.Icon.PLAYER_PLAY, palette.GOOD, "Move the rope to the goal"),
}
"""Command to the arms, icon, colour and hint of each next step, by label."""
RUN_REQUESTS = {"Pause": TaskRequest.PAUSE, "Stop": TaskRequest.STOP}
"""Requests of the buttons of a run, by label."""
RESET_REQUESTS = {"Rope": TaskRequest.RESET, "Scenario": TaskRequest.RESTORE}
"""Requests of the buttons of a simulated cell, by label."""
SETTLE_TIME = SECOND
"""Time for which a new next step of a real arm is not obeyed [ns]: it stands where the one before
it stood, and the second click of a double click was meant for that one."""
CONTINUE_TIME = 3 * SECOND
"""Time within which the arms must answer for Continue to go on by itself [ns]."""
NUMBERS_PERIOD = SECOND // 5
"""Least time between two headlines that differ in their numbers only [ns]."""
HEADLINE_SIZE = 1.05
"""Size of the headline's text [em]; two lines hold the state, distance and clearance."""
HEADLINE_HEIGHT = 6.6
"""Height of two such lines and a line of detail [em]: nothing below moves when they wrap."""


class RunControls:
    """State of the cell, the next step, Pause and Stop of a run, and the resets of a simulation."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        outbox: Outbox,
        live: bool,
        simulated: bool,
        command: Callable[[ArmCommand.Action, str], None],
    ) -> None:
        self._outbox, self._live, self._simulated = outbox, live, simulated
        self._command = command
        self.headline = gui.add_html(_headline_html(status_text.headline(None, 0.0, None)))
        """Element with the state of the cell."""
        self._shown: StatusLine | None = None
        self._shown_time = self._now = self._step_time = 0
        self._step = ""
        """Next step that is offered; empty where there is none."""
        self._continued: int | None = None
        """Time at which a person pressed Continue while the arms held [ns]."""
        self._resumed = False
        """Whether the arms have been resumed since."""
        self._arms: ArmStates | None = None
        # Above the next step, which comes and goes: Pause and Stop keep their places.
        self._groups = {
            RUNNING: self._add_group(gui, actions, RUN_REQUESTS),
            PAUSED: self._add_group(gui, actions, {"Stop": TaskRequest.STOP}),
        }
        self._buttons = {
            label: gui.add_button(label, icon=icon, color=color, visible=False, hint=hint)
            for label, (_, icon, color, hint) in STEPS.items()
        }
        for label, button in self._buttons.items():
            button.on_click(lambda _, s=label: actions.put(lambda: self._press(s)))
        if live and simulated:
            self._add_group(
                gui,
                actions,
                RESET_REQUESTS,
                title="Reset",
                hint="Rope returns rope and arms to the start and keeps goal and obstacles; "
                "Scenario returns those too",
            ).visible = True

    def _add_group(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        requests: dict[str, TaskRequest.Action],
        title: str = "Run",
        hint: str = "Pause holds and can be continued; Stop ends the run",
    ) -> viser.GuiButtonGroupHandle:
        group = gui.add_button_group(title, tuple(requests), visible=False, hint=hint)
        group.on_click(
            lambda event: actions.put(
                lambda label=event.target.value: self._outbox.request_task(requests[label], label)
            )
        )
        return group

    def _press(self, label: str) -> None:
        arms = self._arms
        too_soon = not self._simulated and self._now - self._step_time < SETTLE_TIME
        if label != self._step or arms is None or too_soon:
            return
        action = STEPS[label][0]
        if action is not None:
            self._command(action, label)
        elif not (arms.needs_acknowledgement or arms.needs_resume):
            self._outbox.request_task(TaskRequest.START, label)
        else:
            self._continued, self._resumed = self._now, False
            if arms.needs_acknowledgement:
                self._command(ArmCommand.ACKNOWLEDGE, label)

    def _go_on(self, arms: ArmStates, task: TaskState) -> None:
        """Do after Continue what arms that exist only in simulation need, and a paused run."""
        if arms.needs_resume and not self._resumed:
            self._resumed = True
            self._command(ArmCommand.RESUME, CONTINUE)
        elif not (arms.needs_acknowledgement or arms.needs_resume):
            self._continued = None
            if task.state == PAUSED:
                self._outbox.request_task(TaskRequest.START, CONTINUE)

    def update(
        self, headline: StatusLine, task: TaskState | None, arms: ArmStates | None, now: int
    ) -> None:
        """Show the state of the cell and what can be done."""
        is_due = _state(headline) != _state(self._shown) or not (
            0 <= now - self._shown_time < NUMBERS_PERIOD
        )
        if headline != self._shown and is_due:
            self._shown, self._shown_time = headline, now
            self.headline.content = _headline_html(headline)
        self._arms, self._now = arms, now
        if not self._live:
            return
        if self._continued is not None and arms is not None and task is not None:
            if now - self._continued < CONTINUE_TIME:
                self._go_on(arms, task)
            else:
                self._continued = None
        step = next_step(task, arms, self._simulated)
        if step != self._step:
            self._step, self._step_time = step, now
            for label, button in self._buttons.items():
                button.visible = label == step
        state = None if task is None else task.state
        for shown, group in self._groups.items():
            group.visible = state == shown


def next_step(task: TaskState | None, arms: ArmStates | None, simulated: bool) -> str:
    """Label of the button that a person would press next; empty if there is nothing to press."""
    if task is None or arms is None:
        return ""
    if arms.needs_acknowledgement:
        return CONTINUE if simulated else "Acknowledge"
    if arms.needs_resume:
        return CONTINUE if simulated else "Resume arms"
    if arms.mode == ArmStates.DISARMED:
        # An approach is offered beside HOLD.
        return "" if arms.needs_approach else "Arm"
    if task.state == RUNNING:
        return ""
    return CONTINUE if task.state == PAUSED else "Start"


def _state(line: StatusLine | None) -> tuple[str, str]:
    """Words of a headline before its numbers, and its detail."""
    return ("", "") if line is None else (line.text.partition(":")[0], line.detail)


def _headline_html(line: StatusLine) -> str:
    return (
        f"<div style='min-height:{HEADLINE_HEIGHT}em;font-variant-numeric:tabular-nums'>"
        f"{status_text.as_html(line, size=f'{HEADLINE_SIZE}em')}</div>"
    )

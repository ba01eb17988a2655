"""The headline, the run's buttons and the arms' buttons."""

from __future__ import annotations

import html
from collections.abc import Callable

import viser

from dashboard import palette
from dashboard.action_queue import Actions
from dashboard.controls import status_text
from dashboard.controls.status_text import Line
from dashboard.outbox import Complaint, Outbox
from shared.messages import PAUSED, RUNNING, ArmCommand, ArmStates, TaskRequest, TaskState
from shared.scenario import SIDES, Side
from shared.service import SECOND

RESET = "Reset"
GRIPPER = ("Open", "Close")
ARMS_PERIOD = SECOND // 2
"""Between two looks at the numbers of the arms [ns]."""


class RunControls:
    """What the whole cell does, and the four buttons of a run."""

    def __init__(
        self, gui: viser.GuiApi, actions: Actions, outbox: Outbox, live: bool, resettable: bool
    ) -> None:
        """Args:
        live: Whether there is a cell that hears the buttons.
        resettable: Whether the cell is simulated as a whole, so that it can return to its start.
        """
        self._headline = gui.add_html(status_text.as_html(status_text.headline(None, 0.0, None)))
        self._shown: Line | None = None
        self._start = gui.add_button(
            "Start",
            icon=viser.Icon.PLAYER_PLAY,
            color=palette.GOOD,
            visible=live,
            hint="Move the rope to the goal",
        )
        self._start.on_click(lambda _: actions.put(lambda: outbox.task(TaskRequest.START, "Start")))
        names = ("Pause", "Stop", RESET) if resettable else ("Pause", "Stop")
        requests = {
            "Pause": TaskRequest.PAUSE,
            "Stop": TaskRequest.STOP,
            RESET: TaskRequest.RESET,
        }
        group = gui.add_button_group(
            "Run",
            names,
            visible=live,
            hint="Pause holds and can be resumed; Stop ends the run; Reset returns to the start",
        )
        group.on_click(
            lambda event: actions.put(
                lambda name=event.target.value: outbox.task(requests[name], name)
            )
        )

    def update(self, line: Line, task: TaskState | None) -> None:
        """Shows the cell's state."""
        if line != self._shown:
            self._shown = line
            self._headline.content = status_text.as_html(line, size="1.15em")
        label = "Resume" if task is not None and task.state == PAUSED else "Start"
        if self._start.label != label:
            self._start.label = label
        running = task is None or task.state == RUNNING
        if self._start.disabled != running:
            self._start.disabled = running


class ArmControls:
    """What the gateway says, and the buttons that it understands."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: Actions,
        outbox: Outbox,
        live: bool,
        complain: Callable[[Complaint], None],
    ) -> None:
        self._outbox = outbox
        self._complain = complain
        self._live = live
        self._boot = ""
        self._state = gui.add_html("")
        self._shown: Line | None = None
        self._acknowledge = gui.add_button(
            "Acknowledge",
            icon=viser.Icon.CHECK,
            color=palette.WARNING,
            visible=False,
            hint="You have looked at the cell: it may move again",
        )
        self._arm = gui.add_button("Arm", icon=viser.Icon.POWER, color=palette.BRAND, visible=False)
        self._hold = gui.add_button(
            "Hold",
            icon=viser.Icon.HAND_STOP,
            color=palette.BAD,
            visible=False,
            hint="Brake now. This is software: the emergency stop is the hard-wired one",
        )
        self._disarm = gui.add_button(
            "Disarm", icon=viser.Icon.POWER, color=palette.NEUTRAL, visible=False
        )
        self._arms = gui.add_html("")
        self._told = 0
        self._grippers = {}
        for side in SIDES:
            group = gui.add_button_group(
                f"Gripper {side}",
                GRIPPER,
                visible=False,
                hint="Opens and closes only while the arms rest",
            )
            group.on_click(
                lambda event, s=side: actions.put(lambda w=event.target.value: self._grip(s, w))
            )
            self._grippers[side] = group
        for button, action, words in (
            (self._acknowledge, ArmCommand.ACKNOWLEDGE, "Acknowledge"),
            (self._arm, ArmCommand.ARM, "Arm"),
            (self._hold, ArmCommand.HOLD, "Hold"),
            (self._disarm, ArmCommand.DISARM, "Disarm"),
        ):
            button.on_click(lambda _, a=action, w=words: actions.put(lambda: self._command(a, w)))

    def _grip(self, side: Side, wanted: str) -> None:
        close = wanted == GRIPPER[1]
        self._command(ArmCommand.GRIPPER, f"{wanted} gripper {side}", arm=side, close=close)

    def _command(self, action: ArmCommand.Action, words: str, **fields: object) -> None:
        if not self._boot:
            self._complain(Complaint(f"{words}: not sent", "The robot gateway has not spoken yet."))
            return
        self._outbox.arm(action, self._boot, words, **fields)

    def update(self, arms: ArmStates | None, age: float) -> None:
        """Shows the gateway's state and offers what makes sense in it."""
        line = status_text.arms_line(arms, age)
        if line != self._shown:
            self._shown = line
            self._state.content = status_text.as_html(line)
        if arms is None:
            return
        if abs(arms.stamp - self._told) >= ARMS_PERIOD:
            self._told = arms.stamp
            words = "<br>".join(html.escape(status_text.arm_words(a)) for a in arms.arms)
            self._arms.content = (
                f'<div style="margin:.3em 1em;font-size:.8em;opacity:.75">{words}</div>'
            )
        if not self._live:
            return
        self._boot = arms.boot
        for arm in arms.arms:
            group = self._grippers.get(arm.arm)
            if group is not None and group.visible != (arm.driver != "fixed"):
                group.visible = arm.driver != "fixed"
        disarmed = arms.mode == ArmStates.DISARMED
        for button, wanted in (
            (self._acknowledge, arms.needs_acknowledgement),
            (self._arm, disarmed),
            (self._disarm, not disarmed),
            (self._hold, not disarmed),
        ):
            if button.visible != wanted:
                button.visible = wanted

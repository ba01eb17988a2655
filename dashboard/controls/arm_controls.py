"""State of the robot gateway and buttons of the arms."""

from __future__ import annotations

from collections.abc import Callable

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.controls.status_text import StatusLine
from dashboard.markup import escaped
from dashboard.outbox import Notification, Outbox
from lariat.scenario import SIDES, Side
from lariat.trajectory import SECOND
from shared.messages import ArmCommand, ArmStates

OPEN_LABEL, CLOSE_LABEL = "Open", "Close"
"""Labels of a gripper's buttons."""
BUTTONS = {
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
    "Disarm": (
        ArmCommand.DISARM,
        viser.Icon.POWER,
        palette.NEUTRAL,
        "Stop the arms and take their power",
    ),
}
"""Action, icon, colour and hint of each button, by label."""
ARM_STATUS_PERIOD = SECOND // 2
"""Time between two updates of the arms' status lines [ns]."""


class ArmControls:
    """Mode of the gateway, and the commands that it accepts in this mode."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        outbox: Outbox,
        live: bool,
        notify: Callable[[Notification], None],
    ) -> None:
        """Add the elements to the page."""
        self._outbox = outbox
        self._notify = notify
        self._live = live
        self._newest: ArmStates | None = None
        self._status = gui.add_html("")
        self._shown: StatusLine | None = None
        # Every button keeps its place: one that appeared where another was would be pressed by
        # mistake. Holding is the stop bar's.
        self._buttons = {
            label: gui.add_button(
                label, icon=icon, color=color, visible=live, disabled=True, hint=hint
            )
            for label, (_, icon, color, hint) in BUTTONS.items()
        }
        self._arm_status = gui.add_html("")
        self._arm_status_stamp = 0
        self._grippers = {}
        for side in SIDES:
            group = gui.add_button_group(
                f"Gripper {side}",
                (OPEN_LABEL, CLOSE_LABEL),
                visible=False,
                hint="Opens and closes only while the arms stand still",
            )
            group.on_click(
                lambda event, s=side: actions.put(
                    lambda label=event.target.value: self._move_gripper(s, label)
                )
            )
            self._grippers[side] = group
        for label, button in self._buttons.items():
            button.on_click(lambda _, s=label: actions.put(lambda: self._press(s)))

    def _press(self, label: str) -> None:
        action = BUTTONS[label][0]
        if action == ArmCommand.ACKNOWLEDGE and self._newest is not None:
            self._command(action, label, session=self._newest.next_session)
        else:
            self._command(action, label)

    def _move_gripper(self, side: Side, label: str) -> None:
        close = label == CLOSE_LABEL
        self._command(ArmCommand.GRIPPER, f"{label} gripper {side}", arm=side, close=close)

    def _command(self, action: ArmCommand.Action, label: str, **fields: object) -> None:
        if self._newest is None:
            self._notify(
                Notification(f"{label}: not sent", "No message from the robot gateway yet.")
            )
            return
        self._outbox.command_arms(action, self._newest, label, **fields)

    def update(self, arms: ArmStates | None, age: float) -> None:
        """Show the state of the gateway and the buttons that apply to it.

        Args:
            arms: Newest state of the gateway.
            age: Its age [s].
        """
        line = status_text.gateway_status(arms, age)
        if line != self._shown:
            self._shown = line
            self._status.content = status_text.as_html(line)
        if arms is None:
            return
        if abs(arms.stamp - self._arm_status_stamp) >= ARM_STATUS_PERIOD:
            self._arm_status_stamp = arms.stamp
            text = "<br>".join(escaped(status_text.arm_status(a)) for a in arms.arms)
            self._arm_status.content = (
                f'<div style="margin:.3em 1em;font-size:.8em;opacity:.75">{text}</div>'
            )
        if not self._live:
            return
        self._newest = arms
        for arm in arms.arms:
            group = self._grippers.get(arm.arm)
            if group is not None and group.visible != (arm.driver != "fixed"):
                group.visible = arm.driver != "fixed"
        for label, button in self._buttons.items():
            disabled = not _applies(BUTTONS[label][0], arms)
            if button.disabled != disabled:
                button.disabled = disabled


def _applies(action: ArmCommand.Action, arms: ArmStates) -> bool:
    """Return whether the gateway would obey an action in this state."""
    match action:
        case ArmCommand.ACKNOWLEDGE:
            return arms.needs_acknowledgement
        case ArmCommand.RESUME:
            return arms.needs_resume
        case ArmCommand.ARM:
            return arms.mode == ArmStates.DISARMED and not arms.needs_approach
    return True

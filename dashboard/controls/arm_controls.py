"""State of the arms, their grippers, and Disarm."""

from __future__ import annotations

from collections.abc import Callable

import viser

from dashboard import palette
from dashboard.action_queue import ActionQueue
from dashboard.controls import status_text
from dashboard.markup import escaped
from dashboard.outbox import Notification, Outbox
from lariat.scenario import SIDES, Side
from lariat.trajectory import SECOND
from shared.messages import ArmCommand, ArmStates

OPEN_LABEL, CLOSE_LABEL = "Open", "Close"
"""Labels of a gripper's buttons."""
ARM_STATUS_PERIOD = SECOND // 2
"""Time between two updates of the arms' status lines [ns]."""


class ArmControls:
    """Mode of the gateway, states of its arms, and the commands to them."""

    def __init__(
        self,
        gui: viser.GuiApi,
        actions: ActionQueue,
        outbox: Outbox,
        live: bool,
        notify: Callable[[Notification], None],
    ) -> None:
        self._outbox = outbox
        self._notify = notify
        self._live = live
        self._newest: ArmStates | None = None
        self._status = gui.add_html("")
        self._status.visible = not live
        self._disarm = gui.add_button(
            "Disarm",
            icon=viser.Icon.POWER,
            color=palette.NEUTRAL,
            visible=False,
            hint="Stop the arms and take their power",
        )
        self._disarm.on_click(
            lambda _: actions.put(lambda: self.command(ArmCommand.DISARM, "Disarm"))
        )
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

    def _move_gripper(self, side: Side, label: str) -> None:
        close = label == CLOSE_LABEL
        self.command(ArmCommand.GRIPPER, f"{label} gripper {side}", arm=side, close=close)

    def command(self, action: ArmCommand.Action, label: str, **fields: object) -> None:
        """Send a command to the arms, in answer to their newest state."""
        if self._newest is None:
            self._notify(
                Notification(f"{label}: not sent", "No message from the robot gateway yet.")
            )
            return
        self._outbox.command_arms(action, self._newest, label, **fields)

    def update(self, arms: ArmStates | None, age: float) -> None:
        """Show the state of the gateway and the buttons that apply to it."""
        self._status.content = status_text.as_html(status_text.gateway_status(arms, age))
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
            if (group := self._grippers.get(arm.arm)) is not None:
                group.visible = arm.driver != "fixed"
        powered = any(a.powered for a in arms.arms)
        self._disarm.visible = powered or arms.mode != ArmStates.DISARMED

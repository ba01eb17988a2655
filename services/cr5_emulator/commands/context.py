"""Services shared by all commands: motion queue, frames, inverse kinematics, number format."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.cr5_emulator.commands.signature import Command, Failure, Parameter
from services.cr5_emulator.controller import Controller, StartAction
from services.cr5_emulator.kinematics import Joints, Transform
from services.cr5_emulator.motions import Alarm

Values = list[Any]
"""Positional values of a call, parsed."""
NamedValues = dict[str, Any]
"""Optional values of a call by key, parsed."""
Table = dict[str, Command]
"""Commands by name."""


class CommandContext:
    """Access of the commands to one controller."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.options = controller.options
        self.v4 = controller.v4
        self.index = Parameter("integer", 0, 50 if self.options.version >= "4.6" else 9)
        """Parameter for the index of a user or tool frame."""
        self.frame_options = tuple(
            Parameter("integer", 0, self.index.high, key) for key in ("user", "tool")
        )
        """Named parameters for the indices of user and tool frame."""

    def run_now(self, action: Callable[[], Any]) -> str:
        """Run an action at once; the reply is empty."""
        if action() is False:
            raise Failure(-1)
        return ""

    def queued(self, start: StartAction) -> str:
        """Append an entry to the motion queue; return the reply. Raises Failure when it is full."""
        number = self.controller.enqueue(start)
        if number is None:
            raise Failure(-1)
        return self.numbered(number)

    def run_in_order(self, action: Callable[[], None]) -> str:
        """Run an action after the motions that are queued; at once when there are none."""
        if self.controller.busy:
            return self.queued(lambda joints: action())
        action()
        return self.numbered(self.controller.count())

    def numbered(self, number: int) -> str:
        """Return the reply to a queued command: on V4 its number."""
        return str(number) if self.v4 and self.options.result_id else ""

    def numbers(self, values: Any) -> str:
        """Format numbers for a reply."""
        return ",".join(f"{v:.{self.options.decimals}f}" for v in values)

    def check_frames(self, *indices: int) -> None:
        """Raise Failure(-1) for a frame other than base and flange: none is calibrated."""
        if any(indices):
            raise Failure(-1)

    def nearest_solution(self, goal: Transform, joints: Joints) -> Joints:
        """Return the inverse solution nearest to joint angles [rad]; alarm 17 out of reach."""
        solutions = self.controller.geometry.all_solutions(goal)
        if not solutions:
            raise Alarm(17)
        # Add the whole turns that bring each joint nearest.
        turns = [s + 2.0 * np.pi * np.round((joints - s) / (2.0 * np.pi)) for s in solutions]
        return min(turns, key=lambda s: float(np.sum((s - joints) ** 2)))

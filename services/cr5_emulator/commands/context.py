"""Services shared by all commands: motion queue, frames, inverse kinematics, number format."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.signature import Command, Failure, Parameter, option
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
        self.shift = np.zeros(6)
        """Offset of the user frame while StartRTOffset is in effect [mm, deg]."""

    # The queue

    def run_now(self, action: Callable[[], Any]) -> str:
        """Run an action at once; the reply is empty."""
        action()
        return ""

    def queued(self, start: StartAction) -> str:
        """Append an entry to the motion queue; return the reply. Raises Failure when it is full."""
        number = self.controller.enqueue(start)
        if number is None:
            raise Failure(-1)
        return self.numbered(number)

    def run_in_order(self, action: Callable[[], Any]) -> str:
        """Run an action after the motions that are queued; at once when there are none."""
        if self.controller.busy:

            def start(joints: Joints) -> None:
                del joints
                action()

            return self.queued(start)
        self.controller.number += 1
        self.controller.finished = self.controller.number
        action()
        return self.numbered(self.controller.number)

    def numbered(self, number: int) -> str:
        """Return the reply to a queued command: on V4 its number."""
        return str(number) if self.v4 and self.options.result_id else ""

    # Replies

    def numbers(self, values: Any) -> str:
        """Format numbers for a reply."""
        return ",".join(f"{v:.{self.options.decimals}f}" for v in values)

    # Frames

    @property
    def index(self) -> Parameter:
        """Parameter for the index of a user or tool frame."""
        return Parameter("integer", 0, self.options.frame_count)

    @property
    def frame_options(self) -> tuple[Parameter, Parameter]:
        """Named parameters for the indices of user and tool frame."""
        most = self.options.frame_count
        return option("user", "integer", 0, most), option("tool", "integer", 0, most)

    def frames(self, options: NamedValues) -> tuple[np.ndarray, np.ndarray]:
        """Return user and tool frame; raises Failure(-1) when one is not calibrated."""
        c = self.controller
        user, tool = options.get("user", c.user), options.get("tool", c.tool)
        if user not in c.users or tool not in c.tools:
            raise Failure(-1)
        return c.users[user], c.tools[tool]

    def flange(self, vector: Any, options: NamedValues) -> Transform:
        """Return the flange pose in the base [m], for a tool pose in the user frame [mm, deg]."""
        user, tool = self.frames(options)
        pose = frames.transform(np.array(vector, dtype=float))
        return frames.to_flange(frames.transform(self.shift) @ pose, user, tool)

    def nearest_solution(self, goal: Transform, joints: Joints) -> Joints:
        """Return the inverse solution nearest to given joint angles [rad].

        Raises:
            Alarm: 17, the pose is out of reach.
        """
        solutions = self.controller.geometry.all_solutions(goal)
        if not solutions:
            raise Alarm(17)
        # Add the whole turns that bring each joint nearest.
        turns = [s + 2.0 * np.pi * np.round((joints - s) / (2.0 * np.pi)) for s in solutions]
        return min(turns, key=lambda s: float(np.sum((s - joints) ** 2)))

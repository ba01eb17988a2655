"""What every command needs: the queue, the frames, and how numbers are written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.signature import Command, Failure, Parameter, option
from services.cr5_emulator.controller import Controller, Start
from services.cr5_emulator.geometry import Joints, Transform
from services.cr5_emulator.motions import Alarm

Values = list[Any]
Options = dict[str, Any]
Table = dict[str, Command]


class Execution:
    """Carries commands out on one controller."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.options = controller.options
        self.v4 = controller.v4
        self.shift = np.zeros(6)
        """Of the user frame while StartRTOffset holds [mm, deg]."""

    # The queue

    def now(self, action: Callable[[], Any]) -> str:
        """Does something at once; the empty answer."""
        action()
        return ""

    def queued(self, start: Start) -> str:
        """The answer to an entry of the queue."""
        number = self.controller.enqueue(start)
        if number is None:
            raise Failure(-1)
        return self.numbered(number)

    def in_turn(self, action: Callable[[], Any]) -> str:
        """Does something behind what the arm has to do; at once when it has nothing."""
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
        """What V4 answers to a queued command."""
        return str(number) if self.v4 and self.options.result_id else ""

    # Text

    def numbers(self, values: Any) -> str:
        """As an answer writes them."""
        return ",".join(f"{v:.{self.options.decimals}f}" for v in values)

    # Frames

    @property
    def index(self) -> Parameter:
        """Index of a user or tool frame."""
        return Parameter("integer", 0, self.options.frame_count)

    @property
    def frame_options(self) -> tuple[Parameter, Parameter]:
        """Indices of the user and tool frame, by name."""
        most = self.options.frame_count
        return option("user", "integer", 0, most), option("tool", "integer", 0, most)

    def frames(self, options: Options) -> tuple[np.ndarray, np.ndarray]:
        """User and tool frame; -1 when one is not calibrated."""
        c = self.controller
        user, tool = options.get("user", c.user), options.get("tool", c.tool)
        if user not in c.users or tool not in c.tools:
            raise Failure(-1)
        return c.users[user], c.tools[tool]

    def flange(self, vector: Any, options: Options) -> Transform:
        """Flange in the base [m] for a pose of the tool in the user frame [mm, deg]."""
        user, tool = self.frames(options)
        pose = frames.transform(np.array(vector, dtype=float))
        return frames.to_flange(frames.transform(self.shift) @ pose, user, tool)

    def near(self, goal: Transform, joints: Joints) -> Joints:
        """The solution nearest to the given joints; alarm 17 without one."""
        solutions = self.controller.geometry.all_solutions(goal)
        if not solutions:
            raise Alarm(17)
        # Whole turns are chosen like branches: nearest.
        turns = [s + 2.0 * np.pi * np.round((joints - s) / (2.0 * np.pi)) for s in solutions]
        return min(turns, key=lambda s: float(np.sum((s - joints) ** 2)))

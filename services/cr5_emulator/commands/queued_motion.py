"""Motion commands: each appends an entry to the motion queue.

The arm stops at every point: blending (CP, cp, r) is accepted without effect.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.io_ports import IoCommands
from services.cr5_emulator.commands.motion_planner import MotionPlanner, Path
from services.cr5_emulator.commands.signature import (
    COMMAND_PORT,
    MOTION_PORT,
    NUMBER,
    SIX_NUMBERS,
    Command,
    Failure,
    Parameter,
    Run,
    option,
)
from services.cr5_emulator.kinematics import Transform
from services.cr5_emulator.motions import Alarm, Delay

TRIGGER_GROUP = Parameter("list", count=4)
"""Output that switches on the way: mode, distance, output, state."""
ROUND_COUNT = Parameter("integer", 1, 999)
"""Number of rounds of a circle."""


class QueuedMotionCommands:
    """Commands that append a motion to the controller's queue."""

    def __init__(self, context: CommandContext, io_ports: IoCommands) -> None:
        self._context = context
        self._arm = context.controller
        self._planner = MotionPlanner(context, io_ports)

    def table(self) -> Table:
        """Return the commands by name."""
        return self._v4() if self._context.v4 else self._v3()

    def _v3(self) -> Table:
        frame = self._context.frame_options
        joint = (*frame, *(option(k, "number", 1, 100) for k in ("speedj", "accj")))
        linear = (*frame, *(option(k, "number", 1, 100) for k in ("speedl", "accl")))
        index = self._context.index
        relative = {
            f"RelMov{kind}{where}": self._motion(
                self._relative(kind, where), (*SIX_NUMBERS, index), joint if kind == "J" else linear
            )
            for kind in "JL"
            for where in ("User", "Tool")
        }
        pause = Command(
            self._wait,
            (Parameter("integer", 1, 3_600_000),),
            ports=(COMMAND_PORT, MOTION_PORT),
            since="3.5.5",
        )
        return {
            "MovJ": self._motion(self._joint_to_pose, SIX_NUMBERS, joint),
            "JointMovJ": self._motion(self._joint_to_joints, SIX_NUMBERS, joint),
            "MovL": self._motion(self._line, SIX_NUMBERS, linear),
            "MovJIO": self._motion(self._joint_to_pose, SIX_NUMBERS, joint, group=(TRIGGER_GROUP,)),
            "MovLIO": self._motion(self._line, SIX_NUMBERS, linear, group=(TRIGGER_GROUP,)),
            "Arc": self._motion(self._arc, SIX_NUMBERS * 2, linear),
            "Circle3": self._motion(
                self._circle, (*SIX_NUMBERS * 2, ROUND_COUNT), linear, since="3.5.5"
            ),
            # Deprecated by the vendor, but still listed.
            "Circle": self._motion(self._circle_first, (ROUND_COUNT, *SIX_NUMBERS * 2), linear),
            "RelMovJ": self._motion(self._relative("J", "User"), SIX_NUMBERS, joint),
            "RelMovL": self._motion(self._relative("L", "User"), (NUMBER,) * 3, linear),
            "RelJointMovJ": self._motion(self._relative_joints, SIX_NUMBERS, joint),
            **relative,
            "Sync": Command(lambda a, o: None if self._arm.busy else "", ports=(MOTION_PORT,)),
            "Wait": pause,
        }

    def _v4(self) -> Table:
        rates = tuple(option(k, "number", 1, 100) for k in ("a", "v"))
        joint = (*self._context.frame_options, *rates, option("cp", "number", 0, 100))
        linear = (*joint, option("speed", "number", 1, 2000), option("r", "number", 0, 1000))
        circular = (*linear, option("mode", "integer", 0, 2))
        splined = (*linear, option("freq", "number", 1e-9, 1), Parameter("text", key="file"))
        relative = {
            f"RelMov{kind}{where}": self._motion(
                self._relative(kind, where), SIX_NUMBERS, joint if kind == "J" else linear
            )
            for kind in "JL"
            for where in ("User", "Tool")
        }
        kinds = option("movetype", "integer", 0, 4)
        return {
            "MovJ": self._motion(self._joint_to_pose, (), joint, points=(1, 1)),
            "MovL": self._motion(self._line, (), linear, points=(1, 1)),
            "MovJIO": self._motion(
                self._joint_to_pose, (), joint, points=(1, 1), group=(TRIGGER_GROUP,)
            ),
            "MovLIO": self._motion(self._line, (), linear, points=(1, 1), group=(TRIGGER_GROUP,)),
            "Arc": self._motion(self._arc, (), circular, points=(2, 2)),
            "ArcIO": self._motion(
                self._arc, (), circular, points=(2, 2), group=(TRIGGER_GROUP,), since="4.6"
            ),
            "Circle": self._motion(self._circle, (ROUND_COUNT,), circular, points=(2, 2)),
            "MovS": self._motion(self._through, (), splined, points=(0, 50), since="4.6"),
            "RelJointMovJ": self._motion(self._relative_joints, SIX_NUMBERS, joint),
            **relative,
            "RunTo": self._motion(self._run_to, (), (*joint, kinds), points=(1, 1), since="4.6"),
            "GetCurrentCommandID": Command(lambda a, o: str(self._arm.finished)),
            "StartRTOffset": Command(lambda a, o: self._offset(True), since="4.6"),
            "EndRTOffset": Command(lambda a, o: self._offset(False), since="4.6"),
            "OffsetPara": Command(self._set_offset, SIX_NUMBERS, since="4.6"),
        }

    def _motion(
        self,
        run: Run,
        required: tuple[Parameter, ...],
        optional: tuple[Parameter, ...],
        **more: Any,
    ) -> Command:
        port = COMMAND_PORT if self._context.v4 else MOTION_PORT
        return Command(run, required, optional, ports=(port,), moves=True, **more)

    # Commands

    def _joint_to_pose(self, values: Values, options: NamedValues) -> str:
        triggers = self._planner.triggers(values, options)
        return self._context.queued(
            self._planner.to_joints(self._planner.goal(values, options), options, triggers)
        )

    def _joint_to_joints(self, values: Values, options: NamedValues) -> str:
        target = np.radians(values[:6])
        return self._context.queued(self._planner.to_joints(lambda j: target, options))

    def _relative_joints(self, values: Values, options: NamedValues) -> str:
        displacement = np.radians(values[:6])
        return self._context.queued(self._planner.to_joints(lambda j: j + displacement, options))

    def _line(self, values: Values, options: NamedValues) -> str:
        goal = self._planner.line_to(self._planner.point(values, options, 0))
        return self._context.queued(
            self._planner.along(goal, options, self._planner.triggers(values, options))
        )

    def _arc(self, values: Values, options: NamedValues) -> str:
        through, end = (
            self._planner.point(values, options, 0),
            self._planner.point(values, options, 1),
        )
        triggers = self._planner.triggers(values, options) if "points" in options else ()
        return self._context.queued(
            self._planner.along(
                lambda s: frames.arc(s, through, end, full=False), options, triggers
            )
        )

    def _circle(self, values: Values, options: NamedValues) -> str:
        through, end = (
            self._planner.point(values, options, 0),
            self._planner.point(values, options, 1),
        )
        rounds = values[0] if "points" in options else values[12]

        def path_from(start: Transform) -> tuple[Path | None, float]:
            path, length = frames.arc(start, through, end, full=True)
            if path is None:
                return None, 0.0
            return (lambda s: path((s * rounds) % 1.0)), length * rounds

        return self._context.queued(self._planner.along(path_from, options))

    def _circle_first(self, values: Values, options: NamedValues) -> str:
        """Circle whose number of rounds is the first argument."""
        return self._circle([*values[1:], values[0]], options)

    def _through(self, values: Values, options: NamedValues) -> str:
        """Move on straight lines through points; files of points are absent."""
        del values
        if "file" in options:
            raise Failure(-1)
        count = len(options.get("points", ()))
        if count < 4:
            raise Failure(-20000)
        for k in range(count):
            self._context.queued(
                self._planner.along(
                    self._planner.line_to(self._planner.point([], options, k)), options
                )
            )
        return ""

    def _relative(self, kind: str, where: str) -> Callable[[Values, NamedValues], str]:
        """Return the command RelMovJUser, RelMovLUser, RelMovJTool or RelMovLTool."""

        def run(values: Values, options: NamedValues) -> str:
            offset = frames.transform(np.array([*values[:6], 0.0, 0.0, 0.0][:6], dtype=float))
            options = dict(options)
            if len(values) == 7:
                options[where.lower()] = values[6]
            user, tool = self._context.frames(options)

            def goal(start: Transform) -> Transform:
                pose = frames.in_frames(start, user, tool)
                return frames.to_flange(
                    frames.offset_pose(pose, offset, where == "Tool"), user, tool
                )

            if kind == "J":
                start = self._planner.to_joints(
                    lambda j: self._context.nearest_solution(goal(self._arm.flange(j)), j), options
                )
            else:
                start = self._planner.along(lambda s: self._planner.line_to(goal(s))(s), options)
            return self._context.queued(start)

        return run

    def _run_to(self, values: Values, options: NamedValues) -> str:
        """Move at once, outside the queue; the arm must be at rest."""
        if self._arm.busy:
            raise Failure(-1)
        move_type = options.get("movetype", 1)
        kind, vector = options["points"][0]
        if move_type in (3, 4) and kind == "joint":
            raise Failure(-30001)
        if move_type == 0:
            start = self._planner.to_joints(self._planner.goal(values, options), options)
        elif move_type == 1:
            start = self._planner.along(
                self._planner.line_to(self._planner.point(values, options, 0)), options
            )
        elif move_type == 2:
            displacement = np.radians(vector)
            start = self._planner.to_joints(lambda j: j + displacement, options)
        else:
            user, tool = self._context.frames(options)
            offset = frames.transform(vector)
            pose = frames.in_frames(self._arm.flange(self._arm.target), user, tool)
            goal = frames.to_flange(frames.offset_pose(pose, offset, move_type == 3), user, tool)
            start = self._planner.along(self._planner.line_to(goal), options)
        try:
            self._arm.start_unqueued(start(self._arm.target))
        except Alarm as alarm:
            self._arm.alarm(*alarm.numbers)
            raise Failure(-1) from alarm
        return ""

    def _wait(self, values: Values, options: NamedValues) -> str:
        del options
        return self._context.queued(lambda j: Delay(values[0] / 1e3))

    def _set_offset(self, values: Values, options: NamedValues) -> str:
        del options
        self._arm.client_settings.frame_offset = np.array(values, dtype=float)
        return ""

    def _offset(self, on: bool) -> str:
        def apply() -> None:
            self._context.shift = (
                self._arm.client_settings.frame_offset.copy() if on else np.zeros(6)
            )

        self._context.run_in_order(apply)
        return ""

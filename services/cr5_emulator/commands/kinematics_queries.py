"""Queries of the kinematics: present pose, forward and inverse solutions, checks of a path."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    POSE,
    SIX_NUMBERS,
    SWITCH,
    WRONG_COUNT,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.kinematics import Transform
from services.cr5_emulator.motions import Alarm, LineMotion, check_range

RATE_OPTIONS = tuple(option(k, "number", 1, 100) for k in ("a", "v"))
"""Acceleration and speed [%]; without effect on a check."""
BLENDING_OPTIONS = (option("cp", "number", 0, 100), option("r", "number", 0, 1000))
"""Blending by ratio [%] or radius [mm]; without effect on a check."""
JOINT_LIMIT_ALARMS = range(64, 76)
"""Alarms of joint limits."""
OUT_OF_WORK_AREA = 18
"""Result of a check in place of an alarm of a joint limit."""
CHECK_SPEED, CHECK_ACCELERATION = 0.1, 1.0
"""Motion for which a path is checked [m/s, m/s^2]."""


class KinematicsCommands:
    """Kinematic queries; none of them moves the arm."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller

    def table(self) -> Table:
        """Return the commands by name."""
        context = self._context
        arm = self._arm
        return {
            "GetAngle": Command(lambda a, o: context.numbers(np.degrees(arm.joints))),
            "GetPose": Command(self._pose, (), context.frame_options, counts=(0,)),
            **(self._v4() if context.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        index = self._context.index
        return {
            "PositiveSolution": Command(self._forward, (*SIX_NUMBERS, index, index)),
            "InverseSolution": Command(
                self._inverse, (*SIX_NUMBERS, index, index), (SWITCH, POSE), counts=(8, 9, 10)
            ),
        }

    def _v4(self) -> Table:
        frame = self._context.frame_options
        near = (
            option("usejointnear", "integer", 0, 1),
            Parameter("list", key="jointnear", count=6),
        )
        offset = (POSE,)
        return {
            "PositiveKin": Command(self._forward, SIX_NUMBERS, frame, counts=(6,)),
            "InverseKin": Command(self._inverse, SIX_NUMBERS, (*frame, *near), counts=(6,)),
            "RelPointTool": Command(self._shifted("Tool"), offset, points=(1, 1), since="4.6"),
            "RelPointUser": Command(self._shifted("User"), offset, points=(1, 1), since="4.6"),
            "RelJoint": Command(
                lambda a, o: self._context.numbers(np.add(a[:6], a[6])),
                (*SIX_NUMBERS, POSE),
                since="4.6",
            ),
            "CheckOddMovJ": Command(
                self._check(self._joint_path),
                (),
                (*frame, *RATE_OPTIONS, BLENDING_OPTIONS[0]),
                points=(2, 2),
                joints_only=True,
                since="4.6",
            ),
            "CheckOddMovL": Command(
                self._check(self._line),
                (),
                (*frame, *RATE_OPTIONS, *BLENDING_OPTIONS),
                points=(2, 2),
                joints_only=True,
                since="4.6",
            ),
            "CheckOddMovC": Command(
                self._check(self._arc),
                (),
                (*frame, *RATE_OPTIONS, *BLENDING_OPTIONS),
                points=(3, 3),
                joints_only=True,
                since="4.6",
            ),
        }

    def _pose(self, values: Values, options: NamedValues) -> str:
        del values
        if len(options) == 1:
            raise Failure(WRONG_COUNT)
        return self._format_pose(self._arm.flange(self._arm.joints), options)

    def _format_pose(self, flange: Transform, options: NamedValues) -> str:
        return self._context.numbers(
            frames.vector(frames.in_frames(flange, *self._context.frames(options)))
        )

    def _forward(self, values: Values, options: NamedValues) -> str:
        if len(values) >= 8:
            options = {"user": values[6], "tool": values[7]}
        return self._format_pose(self._arm.flange(np.radians(values[:6])), options)

    def _inverse(self, values: Values, options: NamedValues) -> str:
        near = self._arm.joints
        if len(values) >= 8:
            if len(values) == 10 and values[8]:
                near = np.radians(values[9])
            options = {"user": values[6], "tool": values[7]}
        elif options.get("usejointnear") and "jointnear" in options:
            near = np.radians(options["jointnear"])
        try:
            joints = self._context.nearest_solution(self._context.flange(values[:6], options), near)
        except Alarm as alarm:
            raise Failure(-1) from alarm
        return self._context.numbers(np.degrees(joints))

    def _shifted(self, where: str) -> Callable[[Values, NamedValues], str]:
        """Return the command RelPointTool or RelPointUser: a point offset in tool or user frame."""

        def run(values: Values, options: NamedValues) -> str:
            kind, vector = options["points"][0]
            if kind == "joint":
                flange = self._arm.flange(np.radians(vector))
                pose = frames.in_frames(flange, *self._context.frames({}))
            else:
                pose = frames.transform(vector)
            moved = frames.offset_pose(pose, frames.transform(np.array(values[0])), where == "Tool")
            return self._context.numbers(frames.vector(moved))

        return run

    # Checks

    def _check(
        self, path: Callable[[list[np.ndarray]], None]
    ) -> Callable[[Values, NamedValues], str]:
        """Return a check: 0 when the path is possible, -1 while the arm moves, else an alarm."""

        def run(values: Values, options: NamedValues) -> str:
            del values
            if self._arm.busy:
                return "-1"
            self._context.frames(options)
            try:
                path([np.radians(vector) for _, vector in options["points"]])
            except Alarm as alarm:
                number = alarm.numbers[0]
                return str(OUT_OF_WORK_AREA if number in JOINT_LIMIT_ALARMS else number)
            return "0"

        return run

    def _joint_path(self, points: list[np.ndarray]) -> None:
        for joints in points:
            check_range(joints)

    def _line(self, points: list[np.ndarray]) -> None:
        self._joint_path(points)
        start, end = (self._arm.flange(p) for p in points)
        length = max(float(np.linalg.norm(end[:3, 3] - start[:3, 3])), 1e-3)
        self._check_line_motion(points[0], lambda s: frames.interpolate(start, end, s), length)

    def _arc(self, points: list[np.ndarray]) -> None:
        self._joint_path(points)
        path, length = frames.arc(*(self._arm.flange(p) for p in points), full=False)
        if path is None:
            raise Alarm(19)
        self._check_line_motion(points[0], path, length)

    def _check_line_motion(
        self, start: np.ndarray, path: Callable[[float], Transform], length: float
    ) -> None:
        LineMotion(self._arm.geometry, start, path, length, CHECK_SPEED, CHECK_ACCELERATION)

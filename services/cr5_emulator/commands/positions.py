"""Where the arm is, where it would be, and whether it could get there; nothing moves."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
from services.cr5_emulator.commands.signature import (
    POSE,
    SIX,
    SWITCH,
    WRONG_COUNT,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.geometry import Transform
from services.cr5_emulator.motions import Alarm, LineMotion, check_range

RATES = tuple(option(k, "number", 1, 100) for k in ("a", "v"))
BLENDING = (option("cp", "number", 0, 100), option("r", "number", 0, 1000))
REFUSED = {64, 65, 66, 67, 68, 69, 70, 71, 72, 73, 74, 75}
"""Alarms of joints past their ends, which a check calls 18."""


class Positions:
    """Kinematics on the wire."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._arm = execution.controller

    def table(self) -> Table:
        """Commands by name."""
        do = self._do
        arm = self._arm
        return {
            "GetAngle": Command(lambda a, o: do.numbers(np.degrees(arm.joints))),
            "GetPose": Command(self._pose, (), do.frame_options, counts=(0,)),
            **(self._v4() if do.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        index = self._do.index
        return {
            "PositiveSolution": Command(self._forward, (*SIX, index, index)),
            "InverseSolution": Command(
                self._inverse, (*SIX, index, index), (SWITCH, POSE), counts=(8, 9, 10)
            ),
        }

    def _v4(self) -> Table:
        frame = self._do.frame_options
        near = (
            option("usejointnear", "integer", 0, 1),
            Parameter("list", key="jointnear", count=6),
        )
        offset = (POSE,)
        return {
            "PositiveKin": Command(self._forward, SIX, frame, counts=(6,)),
            "InverseKin": Command(self._inverse, SIX, (*frame, *near), counts=(6,)),
            "RelPointTool": Command(self._shifted("Tool"), offset, points=(1, 1), since="4.6"),
            "RelPointUser": Command(self._shifted("User"), offset, points=(1, 1), since="4.6"),
            "RelJoint": Command(
                lambda a, o: self._do.numbers(np.add(a[:6], a[6])), (*SIX, POSE), since="4.6"
            ),
            "CheckOddMovJ": Command(
                self._check(self._joint_path),
                (),
                (*frame, *RATES, BLENDING[0]),
                points=(2, 2),
                joints_only=True,
                since="4.6",
            ),
            "CheckOddMovL": Command(
                self._check(self._line),
                (),
                (*frame, *RATES, *BLENDING),
                points=(2, 2),
                joints_only=True,
                since="4.6",
            ),
            "CheckOddMovC": Command(
                self._check(self._arc),
                (),
                (*frame, *RATES, *BLENDING),
                points=(3, 3),
                joints_only=True,
                since="4.6",
            ),
        }

    def _pose(self, values: Values, options: Options) -> str:
        del values
        if len(options) == 1:
            raise Failure(WRONG_COUNT)
        return self._written(self._arm.flange(self._arm.joints), options)

    def _written(self, flange: Transform, options: Options) -> str:
        return self._do.numbers(frames.vector(frames.in_frames(flange, *self._do.frames(options))))

    def _forward(self, values: Values, options: Options) -> str:
        if len(values) >= 8:
            options = {"user": values[6], "tool": values[7]}
        return self._written(self._arm.flange(np.radians(values[:6])), options)

    def _inverse(self, values: Values, options: Options) -> str:
        near = self._arm.joints
        if len(values) >= 8:
            if len(values) == 10 and values[8]:
                near = np.radians(values[9])
            options = {"user": values[6], "tool": values[7]}
        elif options.get("usejointnear") and "jointnear" in options:
            near = np.radians(options["jointnear"])
        try:
            joints = self._do.near(self._do.flange(values[:6], options), near)
        except Alarm as alarm:
            raise Failure(-1) from alarm
        return self._do.numbers(np.degrees(joints))

    def _shifted(self, where: str) -> Callable[[Values, Options], str]:
        """A point moved along the tool's or the user frame's axes."""

        def run(values: Values, options: Options) -> str:
            kind, vector = options["points"][0]
            if kind == "joint":
                flange = self._arm.flange(np.radians(vector))
                pose = frames.in_frames(flange, *self._do.frames({}))
            else:
                pose = frames.transform(vector)
            moved = frames.moved(pose, frames.transform(np.array(values[0])), where == "Tool")
            return self._do.numbers(frames.vector(moved))

        return run

    # Checks

    def _check(self, path: Callable[[list[np.ndarray]], None]) -> Callable[[Values, Options], str]:
        """0 when it can be gone, -1 while the arm moves, or what is in the way."""

        def run(values: Values, options: Options) -> str:
            del values
            if self._arm.busy:
                return "-1"
            self._do.frames(options)
            try:
                path([np.radians(vector) for _, vector in options["points"]])
            except Alarm as alarm:
                return str(18 if alarm.numbers[0] in REFUSED else alarm.numbers[0])
            return "0"

        return run

    def _joint_path(self, points: list[np.ndarray]) -> None:
        for joints in points:
            check_range(joints)

    def _line(self, points: list[np.ndarray]) -> None:
        self._joint_path(points)
        start, end = (self._arm.flange(p) for p in points)
        way = max(float(np.linalg.norm(end[:3, 3] - start[:3, 3])), 1e-3)
        self._go(points[0], lambda s: frames.line(start, end, s), way)

    def _arc(self, points: list[np.ndarray]) -> None:
        self._joint_path(points)
        path, length = frames.arc(*(self._arm.flange(p) for p in points), full=False)
        if path is None:
            raise Alarm(19)
        self._go(points[0], path, length)

    def _go(self, start: np.ndarray, path: Callable[[float], Transform], length: float) -> None:
        LineMotion(self._arm.geometry, start, path, length, 0.1, 1.0)

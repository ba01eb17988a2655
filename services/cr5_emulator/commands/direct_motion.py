"""Commands that move the arm without planning: servo points, jogging, and EmulatorPlace."""

from __future__ import annotations

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    COMMAND_PORT,
    MOTION_PORT,
    NUMBER,
    SIX_NUMBERS,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.motions import JOINT_SPEED, Alarm, JogMotion
from services.cr5_emulator.servo_follower import NOMINAL_GAIN, NOMINAL_LOOKAHEAD

SERVO_TIME = 0.1
"""Default time of a servo point [s]."""
JOG_RATIO = 0.25
"""Jog speed of a joint, as a fraction of its maximum."""
JOG_SPEED, JOG_ANGULAR_SPEED = 0.25, 0.5
"""Jog speed of the flange [m/s, rad/s]."""
JOINT_NAMES = tuple(f"J{k}" for k in range(1, 7))
AXIS_NAMES = ("X", "Y", "Z", "RX", "RY", "RZ")
"""Names of joints and axes in MoveJog."""


class DirectMotionCommands:
    """Commands of motions that the client controls while they run."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        self._frame = 1
        """Argument `coordtype` of the last jog along an axis."""

    def table(self) -> Table:
        """Return the commands by name."""
        context = self._context
        release = context.options.version
        ports = (COMMAND_PORT,) if context.v4 else (MOTION_PORT,)
        # Users report that 3.5.2 accepts at most half a turn either way.
        joint = Parameter("number", -180, 180) if release == "3.5.2" else NUMBER
        timed = release >= "3.5.5"
        return {
            "ServoJ": Command(
                self._servo_joints, (joint,) * 6, self._options(timed), ports=ports, moves=True
            ),
            "ServoP": Command(
                self._servo_pose, SIX_NUMBERS, self._options(context.v4), ports=ports, moves=True
            ),
            "MoveJog": Command(
                self._jog,
                (),
                (Parameter("any"), option("coordtype", "integer", 0, 2), *context.frame_options),
                ports=ports,
                moves=True,
            ),
            "EmulatorPlace": Command(self._place, SIX_NUMBERS),
        }

    def _options(self, timed: bool) -> tuple[Parameter, ...]:
        """Optional parameters of servo points; ServoP of V3 has none."""
        if not timed:
            return ()
        shortest = 0.004 if self._context.options.version >= "4.6" else 0.02
        return (
            option("t", "number", shortest, 3600.0),
            option("aheadtime" if self._context.v4 else "lookahead_time", "number", 20, 100),
            option("gain", "number", 200, 1000),
        )

    # Servo points

    def _servo_joints(self, values: Values, options: NamedValues) -> str:
        return self._servo(np.radians(values[:6]), values[6:], options)

    def _servo_pose(self, values: Values, options: NamedValues) -> str:
        arm = self._arm
        joints = arm.geometry.solve(self._context.flange(values[:6], {}), arm.target)
        if joints is None or np.max(np.abs(joints - arm.target)) > np.pi:
            arm.alarm(33)
            raise Failure(-1)
        return self._servo(joints, values[6:], options)

    def _servo(self, target: np.ndarray, rest: Values, options: NamedValues) -> str:
        arm = self._arm
        names = ("t", "aheadtime" if self._context.v4 else "lookahead_time", "gain")
        settings = {**dict(zip(names, rest, strict=False)), **options}
        # ServoP of V3 states no time, and the time it takes is not documented.
        default_time = SERVO_TIME if self._context.v4 or rest or options else arm.options.servo_time
        try:
            arm.follow_point(
                target,
                settings.get("t", default_time),
                settings.get(names[1], NOMINAL_LOOKAHEAD),
                settings.get("gain", NOMINAL_GAIN),
            )
        except Alarm as alarm:
            arm.alarm(*alarm.numbers)
            raise Failure(-1) from alarm
        arm.number += 1
        arm.finished = arm.number
        return self._context.numbered(arm.number)

    # Jogging

    def _jog(self, values: Values, options: NamedValues) -> str:
        """Start a jog; without a valid axis, stop it."""
        arm = self._arm
        word = str(values[0]).strip("\"'") if values else ""
        named = {**dict(zip(("coordtype", "user", "tool"), values[1:], strict=False)), **options}
        axis, sign = word[:-1].upper(), {"+": 1.0, "-": -1.0}.get(word[-1:])
        is_axis = axis in JOINT_NAMES or axis in AXIS_NAMES
        # V4 is case-sensitive.
        strict = axis if len(axis) < 2 or axis in JOINT_NAMES else axis[0] + axis[1].lower()
        if sign is None or not is_axis or (self._context.v4 and word[:-1] != strict):
            arm.stop_jog()
            return ""
        self._context.frames({k: v for k, v in named.items() if k != "coordtype"})
        ratio = sign * arm.speed_factor / 100.0
        if axis in JOINT_NAMES:
            rate = np.zeros(6)
            rate[int(axis[1]) - 1] = JOG_RATIO * JOINT_SPEED * ratio
            motion = JogMotion(arm.geometry, rate, None)
        else:
            motion = JogMotion(arm.geometry, None, self._twist(axis, ratio, named))
        if self._context.v4:
            arm.start_unqueued(motion)
            return ""
        return self._context.queued(lambda j: motion)

    def _twist(self, axis: str, ratio: float, named: NamedValues) -> np.ndarray:
        """Return the twist of the flange in the base [m/s, rad/s]."""
        kind = named.get("coordtype", self._frame)
        if self._context.v4 and kind == 0:
            raise Failure(-6 if self._context.options.version >= "4.6" else -1)
        self._frame = kind
        twist = np.zeros(6)
        turns = axis.startswith("R")
        k = "XYZ".index(axis[-1])
        twist[3 + k if turns else k] = (JOG_ANGULAR_SPEED if turns else JOG_SPEED) * ratio
        along_tool = kind == (
            2 if self._context.v4 or self._context.options.version < "3.5.7" else 1
        )
        if along_tool:
            R = self._arm.flange(self._arm.target)[:3, :3]
        else:
            R = frames.transform(self._context.frames(named)[0])[:3, :3]
        return np.concatenate([R @ twist[:3], R @ twist[3:]])

    # Placing

    def _place(self, values: Values, options: NamedValues) -> str:
        """Put the flange at a pose instantly, for the reset of a simulation; no real arm can."""
        del options
        goal = frames.transform(np.array(values, dtype=float))
        # The branch of the start: another one may lead the elbow through the table.
        start = np.radians(self._context.options.joints)
        try:
            near = self._context.nearest_solution(goal, start)
        except Alarm:
            raise Failure(-1) from None
        if not self._arm.place(goal, near):
            raise Failure(-1)
        return ""

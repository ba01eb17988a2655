"""What moves the arm without a plan: servo points and jogging, and the emulator's own placing."""

from __future__ import annotations

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
from services.cr5_emulator.commands.signature import (
    COMMAND_PORT,
    MOTION_PORT,
    NUMBER,
    SIX,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.motions import JOINT_SPEED, Alarm, JogMotion

SERVO_TIME = 0.1
LOOKAHEAD = 50.0
GAIN = 500.0
JOG_SHARE = 0.25
"""Of a joint's speed."""
JOG_SPEED, JOG_TURN = 0.25, 0.5
"""Of the flange [m/s, rad/s]."""
JOINTS = tuple(f"J{k}" for k in range(1, 7))
DIRECTIONS = ("X", "Y", "Z", "RX", "RY", "RZ")


class Following:
    """Motions that a client steers while they run."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._arm = execution.controller
        self._frame = 1
        """CoordType of the last jog along an axis."""

    def table(self) -> Table:
        """Commands by name."""
        do = self._do
        release = do.options.version
        ports = (COMMAND_PORT,) if do.v4 else (MOTION_PORT,)
        # Its users report that 3.5.2 takes half a turn either way.
        joint = Parameter("number", -180, 180) if release == "3.5.2" else NUMBER
        timed = release >= "3.5.5"
        return {
            "ServoJ": Command(
                self._servo_joints, (joint,) * 6, self._options(timed), ports=ports, moves=True
            ),
            "ServoP": Command(self._servo_pose, SIX, self._options(do.v4), ports=ports, moves=True),
            "MoveJog": Command(
                self._jog,
                (),
                (Parameter("any"), option("coordtype", "integer", 0, 2), *do.frame_options),
                ports=ports,
                moves=True,
            ),
            "EmulatorPlace": Command(self._place, SIX),
        }

    def _options(self, timed: bool) -> tuple[Parameter, ...]:
        """Of servo points; V3's ServoP never took any."""
        if not timed:
            return ()
        shortest = 0.004 if self._do.options.version >= "4.6" else 0.02
        return (
            option("t", "number", shortest, 3600.0),
            option("aheadtime" if self._do.v4 else "lookahead_time", "number", 20, 100),
            option("gain", "number", 200, 1000),
        )

    # Servo points

    def _servo_joints(self, values: Values, options: Options) -> str:
        return self._servo(np.radians(values[:6]), values[6:], options)

    def _servo_pose(self, values: Values, options: Options) -> str:
        arm = self._arm
        joints = arm.geometry.solve(self._do.flange(values[:6], {}), arm.target)
        if joints is None or np.max(np.abs(joints - arm.target)) > np.pi:
            arm.alarm(33)
            raise Failure(-1)
        return self._servo(joints, values[6:], options)

    def _servo(self, target: np.ndarray, rest: Values, options: Options) -> str:
        arm = self._arm
        names = ("t", "aheadtime" if self._do.v4 else "lookahead_time", "gain")
        given = {**dict(zip(names, rest, strict=False)), **options}
        # V3's ServoP states no time, and what it takes is not documented.
        usual = SERVO_TIME if self._do.v4 or rest or options else arm.options.servo_time
        try:
            arm.aim(
                target,
                given.get("t", usual),
                given.get(names[1], LOOKAHEAD),
                given.get("gain", GAIN),
            )
        except Alarm as alarm:
            arm.alarm(*alarm.numbers)
            raise Failure(-1) from alarm
        arm.number += 1
        arm.finished = arm.number
        return self._do.numbered(arm.number)

    # Jogging

    def _jog(self, values: Values, options: Options) -> str:
        """Without an axis, or with what is none, it stops."""
        arm = self._arm
        word = str(values[0]).strip("\"'") if values else ""
        named = {**dict(zip(("coordtype", "user", "tool"), values[1:], strict=False)), **options}
        axis, sign = word[:-1].upper(), {"+": 1.0, "-": -1.0}.get(word[-1:])
        known = axis in JOINTS or axis in DIRECTIONS
        # V4 minds upper and lower case.
        strict = axis if len(axis) < 2 or axis in JOINTS else axis[0] + axis[1].lower()
        if sign is None or not known or (self._do.v4 and word[:-1] != strict):
            arm.stop_jog()
            return ""
        self._do.frames({k: v for k, v in named.items() if k != "coordtype"})
        share = sign * arm.speed_factor / 100.0
        if axis in JOINTS:
            rate = np.zeros(6)
            rate[int(axis[1]) - 1] = JOG_SHARE * JOINT_SPEED * share
            motion = JogMotion(arm.geometry, rate, None)
        else:
            motion = JogMotion(arm.geometry, None, self._twist(axis, share, named))
        if self._do.v4:
            arm.move_alone(motion)
            return ""
        return self._do.queued(lambda j: motion)

    def _twist(self, axis: str, share: float, named: Options) -> np.ndarray:
        """Of the flange in the base [m/s, rad/s]."""
        kind = named.get("coordtype", self._frame)
        if self._do.v4 and kind == 0:
            raise Failure(-6 if self._do.options.version >= "4.6" else -1)
        self._frame = kind
        twist = np.zeros(6)
        turns = axis.startswith("R")
        k = "XYZ".index(axis[-1])
        twist[3 + k if turns else k] = (JOG_TURN if turns else JOG_SPEED) * share
        along_tool = kind == (2 if self._do.v4 or self._do.options.version < "3.5.7" else 1)
        if along_tool:
            R = self._arm.flange(self._arm.target)[:3, :3]
        else:
            R = frames.transform(self._do.frames(named)[0])[:3, :3]
        return np.concatenate([R @ twist[:3], R @ twist[3:]])

    # Placing

    def _place(self, values: Values, options: Options) -> str:
        """EmulatorPlace: what no arm can do, for a simulation that begins anew."""
        del options
        arm = self._arm
        goal = frames.transform(np.array(values, dtype=float))
        solutions = arm.geometry.all_solutions(goal)
        if not solutions:
            raise Failure(-1)
        # The branch of now, or else the nearest one.
        near = min(solutions, key=lambda s: float(np.sum((s - arm.target) ** 2)))
        if not arm.place(goal, near):
            raise Failure(-1)
        return ""

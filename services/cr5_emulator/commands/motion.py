"""Commands that move the arm: queued motions, servo points, jogging, and EmulatorPlace.

The arm stops at every point: blending (CP, cp, r) is accepted without effect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

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
    percent,
)
from services.cr5_emulator.kinematics import Joints, Transform
from services.cr5_emulator.motions import (
    JOINT_SPEED,
    LINEAR_ACCELERATION,
    LINEAR_SPEED,
    Alarm,
    JogMotion,
    JointMotion,
    LineMotion,
)
from services.cr5_emulator.servo_follower import NOMINAL_GAIN, NOMINAL_LOOKAHEAD

ROTATION_LENGTH = 0.3
"""Path length that a rotation of 1 rad counts as, so that a pure rotation takes time [m]."""
SERVO_TIME = 0.1
"""Default time of a servo point [s]."""
JOG_RATIO = 0.25
"""Jog speed of a joint, as a fraction of its maximum."""
JOG_SPEED, JOG_ANGULAR_SPEED = 0.25, 0.5
"""Jog speed of the flange [m/s, rad/s]."""
JOINT_NAMES = tuple(f"J{k}" for k in range(1, 7))
AXIS_NAMES = ("X", "Y", "Z", "RX", "RY", "RZ")
"""Names of joints and axes in MoveJog."""


class MotionCommands:
    """Commands of motions."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        self._frame = 1
        """Argument `coordtype` of the last jog along an axis."""

    def table(self) -> Table:
        """Return the commands by name."""
        v4, release = self._context.v4, self._context.options.version
        frame = self._context.frame_options
        if v4:
            joint = (*frame, *percent("a", "v"), *percent("cp", low=0))
            linear = (
                *joint,
                Parameter("number", 1, 2000, "speed"),
                Parameter("number", 0, 1000, "r"),
            )
            index, target = (), ()
        else:
            joint = (*frame, *percent("speedj", "accj"))
            linear = (*frame, *percent("speedl", "accl"))
            index, target = (self._context.index,), SIX_NUMBERS
        # Users report that 3.5.2 accepts at most half a turn either way.
        angle = Parameter("number", -180, 180) if release == "3.5.2" else NUMBER
        jog = (Parameter("any"), Parameter("integer", 0, 2, "coordtype"), *frame)
        table = {
            "MovJ": self._motion(self._move_joints, target, joint, point=v4),
            "MovL": self._motion(self._move_line, target, linear, point=v4),
            "RelJointMovJ": self._motion(self._move_by_joints, SIX_NUMBERS, joint),
            "ServoJ": self._motion(
                self._servo_joints, (angle,) * 6, self._servo_options(release >= "3.5.5")
            ),
            "ServoP": self._motion(self._servo_pose, SIX_NUMBERS, self._servo_options(v4)),
            "MoveJog": self._motion(self._jog, (), jog),
            "EmulatorPlace": Command(self._place, SIX_NUMBERS),
        }
        for kind, options in (("J", joint), ("L", linear)):
            for where in ("User", "Tool"):
                table[f"RelMov{kind}{where}"] = self._motion(
                    self._relative(kind, where), (*SIX_NUMBERS, *index), options
                )
        if v4:
            return table | {"GetCurrentCommandID": Command(lambda a, o: str(self._arm.finished))}
        return table | {
            "JointMovJ": self._motion(self._move_to_joints, SIX_NUMBERS, joint),
            "Sync": Command(lambda a, o: None if self._arm.busy else "", port=MOTION_PORT),
        }

    def _motion(self, run: Any, required: Any, optional: Any, point: bool = False) -> Command:
        port = COMMAND_PORT if self._context.v4 else MOTION_PORT
        return Command(run, required, optional, point=point, port=port, moves=True)

    # Queued motions

    def _move_joints(self, values: Values, options: NamedValues) -> str:
        if options.get("point", ("pose",))[0] == "joint":
            return self._move_to_joints(options["point"][1], options)
        pose = self._pose(values, options)
        return self._to_joints(lambda j: self._context.nearest_solution(pose, j), options)

    def _move_to_joints(self, values: Any, options: NamedValues) -> str:
        target = np.radians(values[:6])
        return self._to_joints(lambda j: target, options)

    def _move_by_joints(self, values: Values, options: NamedValues) -> str:
        displacement = np.radians(values[:6])
        return self._to_joints(lambda j: j + displacement, options)

    def _move_line(self, values: Values, options: NamedValues) -> str:
        pose = self._pose(values, options)
        return self._along_line(lambda start: pose, options)

    def _relative(self, kind: str, where: str) -> Callable[[Values, NamedValues], str]:
        """Return the command RelMovJUser, RelMovLUser, RelMovJTool or RelMovLTool."""

        def run(values: Values, options: NamedValues) -> str:
            self._context.check_frames(*values[6:], *map(options.get, ("user", "tool")))
            offset = frames.transform(np.array(values[:6], dtype=float))

            def goal(start: Transform) -> Transform:
                return frames.offset_pose(start, offset, where == "Tool")

            if kind == "L":
                return self._along_line(goal, options)
            return self._to_joints(
                lambda j: self._context.nearest_solution(goal(self._arm.flange(j)), j), options
            )

        return run

    def _pose(self, values: Values, options: NamedValues) -> Transform:
        """Return the flange pose in the base [m] of a command's point."""
        self._context.check_frames(*map(options.get, ("user", "tool")))
        kind, vector = options.get("point", ("pose", np.array(values[:6], dtype=float)))
        return self._arm.flange(np.radians(vector)) if kind == "joint" else frames.transform(vector)

    def _rates(self, options: NamedValues, letter: str) -> tuple[float, float]:
        """Return speed and acceleration as fractions of the maximum."""
        ratios = self._arm.ratios
        speed = options.get(f"speed{letter}", options.get("v", ratios[f"speed{letter}"]))
        acceleration = options.get(f"acc{letter}", options.get("a", ratios[f"acc{letter}"]))
        return speed / 100.0 * self._arm.speed_factor / 100.0, acceleration / 100.0

    def _to_joints(self, goal: Callable[[Joints], Joints], options: NamedValues) -> str:
        """Queue a motion of all joints to a goal, given the joint angles at its start."""
        rates = self._rates(options, "j")
        return self._context.queued(lambda joints: JointMotion(joints, goal(joints), *rates))

    def _along_line(self, goal: Callable[[Transform], Transform], options: NamedValues) -> str:
        """Queue a straight motion of the flange to a goal, given its pose at the start."""
        speed, acceleration = self._rates(options, "l")
        speed = options["speed"] / 1e3 if "speed" in options else speed * LINEAR_SPEED

        def start(joints: Joints) -> LineMotion:
            begin = self._arm.flange(joints)
            end = goal(begin)
            cosine = (float(np.trace(end[:3, :3] @ begin[:3, :3].T)) - 1.0) / 2.0
            rotation = ROTATION_LENGTH * float(np.arccos(np.clip(cosine, -1.0, 1.0)))
            return LineMotion(
                self._arm.geometry,
                joints,
                lambda progress: frames.interpolate(begin, end, progress),
                max(float(np.linalg.norm(end[:3, 3] - begin[:3, 3])), rotation),
                speed,
                acceleration * LINEAR_ACCELERATION,
            )

        return self._context.queued(start)

    # Servo points

    def _servo_options(self, timed: bool) -> tuple[Parameter, ...]:
        """Optional parameters of servo points; ServoP of V3 has none."""
        if not timed:
            return ()
        shortest = 0.004 if self._context.options.version >= "4.6" else 0.02
        lookahead = Parameter("number", 20, 100, "aheadtime")
        # The vendor's ROS driver names it as on V4 also to V3, whose documents name it differently.
        v3 = () if self._context.v4 else (lookahead,)
        return (
            Parameter("number", shortest, 3600.0, "t"),
            lookahead if self._context.v4 else replace(lookahead, key="lookahead_time"),
            Parameter("number", 200, 1000, "gain"),
            *v3,
        )

    def _servo_joints(self, values: Values, options: NamedValues) -> str:
        return self._servo(np.radians(values[:6]), values[6:9], options)

    def _servo_pose(self, values: Values, options: NamedValues) -> str:
        arm = self._arm
        goal = frames.transform(np.array(values[:6], dtype=float))
        joints = arm.geometry.solve(goal, arm.target)
        if joints is None or np.max(np.abs(joints - arm.target)) > np.pi:
            arm.alarm(33)
            raise Failure(-1)
        return self._servo(joints, values[6:9], options)

    def _servo(self, target: np.ndarray, rest: Values, options: NamedValues) -> str:
        arm = self._arm
        settings = {**dict(zip(("t", "aheadtime", "gain"), rest, strict=False)), **options}
        # ServoP of V3 states no time, and the time it takes is not documented.
        default_time = SERVO_TIME if self._context.v4 or settings else arm.options.servo_time
        try:
            arm.follow_point(
                target,
                settings.get("t", default_time),
                settings.get("aheadtime", settings.get("lookahead_time", NOMINAL_LOOKAHEAD)),
                settings.get("gain", NOMINAL_GAIN),
            )
        except Alarm as alarm:
            arm.alarm(*alarm.numbers)
            raise Failure(-1) from alarm
        return self._context.numbered(arm.count())

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
        self._context.check_frames(*map(named.get, ("user", "tool")))
        ratio = sign * arm.speed_factor / 100.0
        if axis in JOINT_NAMES:
            rate = np.zeros(6)
            rate[int(axis[1]) - 1] = JOG_RATIO * JOINT_SPEED * ratio
            motion = JogMotion(arm.geometry, rate, None)
        else:
            motion = JogMotion(arm.geometry, None, self._twist(axis, ratio, named))
        if self._context.v4:
            arm.unqueued = motion
            return ""
        return self._context.queued(lambda j: motion)

    def _twist(self, axis: str, ratio: float, named: NamedValues) -> np.ndarray:
        """Return the twist of the flange in the base [m/s, rad/s]."""
        v4, release = self._context.v4, self._context.options.version
        kind = named.get("coordtype", self._frame)
        if v4 and kind == 0:
            raise Failure(-6 if release >= "4.6" else -1)
        self._frame = kind
        twist = np.zeros((2, 3))
        turns = axis.startswith("R")
        twist[int(turns), "XYZ".index(axis[-1])] = (
            JOG_ANGULAR_SPEED if turns else JOG_SPEED
        ) * ratio
        if kind == (2 if v4 or release < "3.5.7" else 1):
            # Along the axes of the tool, not of the base.
            twist = twist @ self._arm.flange(self._arm.target)[:3, :3].T
        return twist.ravel()

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
        return self._context.run_now(lambda: self._arm.place(goal, near))

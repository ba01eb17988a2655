"""Motion commands: from their arguments to entries of the queue."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.robot_gateway.emulator import frames
from services.robot_gateway.emulator.controller import Controller, Start
from services.robot_gateway.emulator.geometry import Joints, Transform
from services.robot_gateway.emulator.motions import (
    JOINT_SPEED,
    LINEAR_ACCELERATION,
    LINEAR_SPEED,
    Alarm,
    Delay,
    JogMotion,
    JointMotion,
    LineMotion,
)
from services.robot_gateway.emulator.signature import Failure, Parameter

Values = list[Any]
Options = dict[str, Any]
SERVO_TIME = 0.1
LOOKAHEAD = 50.0
GAIN = 500.0


class Moves:
    """Puts motions on a controller's queue."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller

    # What options motions take

    def v3_options(self) -> tuple[tuple[Parameter, ...], ...]:
        """Of joint motions, of straight ones, and of the frames."""
        joint = tuple(Parameter("number", 1, 100, k) for k in ("speedj", "accj"))
        linear = tuple(Parameter("number", 1, 100, k) for k in ("speedl", "accl"))
        return joint, linear, self.frame_options()

    def v4_options(self) -> tuple[Parameter, ...]:
        """Of all motions."""
        rates = tuple(Parameter("number", 1, 100, k) for k in ("a", "v"))
        return (
            *self.frame_options(),
            *rates,
            Parameter("number", 0, 100, "cp"),
            Parameter("number", 1, 2000, "speed"),
            Parameter("number", 0, 1000, "r"),
        )

    def frame_options(self) -> tuple[Parameter, ...]:
        """Indices of the user and tool frame."""
        return Parameter("integer", 0, 9, "user"), Parameter("integer", 0, 9, "tool")

    def jog_options(self) -> tuple[Parameter, ...]:
        """Of MoveJog."""
        return Parameter("integer", 0, 2, "coordtype"), *self.frame_options()

    def servo_options(self, pose: bool) -> tuple[Parameter, ...]:
        """Of ServoJ, and of V4's ServoP; V3's takes none."""
        v4 = self.controller.v4
        if pose and not v4:
            return ()
        return (
            Parameter("number", 0.004 if v4 else 0.02, 3600.0, "t"),
            Parameter("number", 20, 100, "aheadtime" if v4 else "lookahead_time"),
            Parameter("number", 200, 1000, "gain"),
        )

    # Queueing

    def queued(self, start: Start) -> str:
        """The answer to an entry of the queue."""
        number = self.controller.enqueue(start)
        if number is None:
            raise Failure(-1)
        return str(number) if self.controller.v4 and self.controller.options.result_id else ""

    def _rates(self, options: Options, linear: bool) -> tuple[float, float]:
        """Speed and acceleration as fractions."""
        c = self.controller
        letter = "l" if linear else "j"
        speed = options.get(f"speed{letter}", options.get("v", c.ratios[f"speed{letter}"]))
        acceleration = options.get(f"acc{letter}", options.get("a", c.ratios[f"acc{letter}"]))
        return speed / 100.0 * c.speed_factor / 100.0, acceleration / 100.0

    def _frames(self, options: Options) -> tuple[np.ndarray, np.ndarray]:
        c = self.controller
        user, tool = options.get("user", c.user), options.get("tool", c.tool)
        if user not in c.users or tool not in c.tools:
            raise Failure(-1)
        return c.users[user], c.tools[tool]

    def _pose(self, vector: Any, options: Options) -> Transform:
        user, tool = self._frames(options)
        return frames.to_flange(frames.transform(np.array(vector, dtype=float)), user, tool)

    def _near(self, goal: Transform, joints: Joints) -> Joints:
        """The solution nearest to the given joints; alarm 17 without one."""
        solutions = self.controller.geometry.all_solutions(goal)
        if not solutions:
            raise Alarm(17)
        # Whole turns are chosen like branches: nearest.
        turns = [s + 2.0 * np.pi * np.round((joints - s) / (2.0 * np.pi)) for s in solutions]
        return min(turns, key=lambda s: float(np.sum((s - joints) ** 2)))

    def _to_joints(self, target: Callable[[Joints], Joints], options: Options) -> str:
        speed, acceleration = self._rates(options, linear=False)
        return self.queued(lambda j: JointMotion(j, target(j), speed, acceleration))

    def _along(self, path_from: Callable[[Transform], tuple[Any, float]], options: Options) -> str:
        speed, acceleration = self._rates(options, linear=True)
        speed *= LINEAR_SPEED
        if "speed" in options:
            speed = options["speed"] / 1e3

        def start(joints: Joints) -> LineMotion:
            path, length = path_from(self.controller.flange(joints))
            if path is None:
                raise Alarm(19)
            return LineMotion(
                self.controller.geometry,
                joints,
                path,
                length,
                speed,
                acceleration * LINEAR_ACCELERATION,
            )

        return self.queued(start)

    # The commands

    def joint_to_pose(self, values: Values, options: Options) -> str:
        """MovJ."""
        kind, vector = options["points"][0] if "points" in options else ("pose", values[:6])
        if kind == "joint":
            return self.joint_to_joints(list(vector), options)
        goal = self._pose(vector, options)
        return self._to_joints(lambda j: self._near(goal, j), options)

    def joint_to_joints(self, values: Values, options: Options) -> str:
        """JointMovJ."""
        target = np.radians(values[:6])
        return self._to_joints(lambda j: target, options)

    def relative_joints(self, values: Values, options: Options) -> str:
        """RelJointMovJ."""
        way = np.radians(values[:6])
        return self._to_joints(lambda j: j + way, options)

    def line(self, values: Values, options: Options) -> str:
        """MovL."""
        return self._along(self._line_to(self._point(values, options, 0)), options)

    def arc(self, values: Values, options: Options) -> str:
        """Arc."""
        through, end = self._point(values, options, 0), self._point(values, options, 1)
        return self._along(lambda start: frames.arc(start, through, end, full=False), options)

    def circle(self, values: Values, options: Options) -> str:
        """Circle3, Circle."""
        through, end = self._point(values, options, 0), self._point(values, options, 1)
        rounds = values[0] if "points" in options else values[12]

        def path_from(start: Transform) -> tuple[Any, float]:
            path, length = frames.arc(start, through, end, full=True)
            if path is None:
                return None, 0.0
            return (lambda s: path((s * rounds) % 1.0)), length * rounds

        return self._along(path_from, options)

    def relative(self, kind: str, where: str) -> Callable[[Values, Options], str]:
        """RelMovJUser, RelMovLUser, RelMovJTool, RelMovLTool."""

        def run(values: Values, options: Options) -> str:
            c = self.controller
            offset = frames.transform(np.array(values[:6], dtype=float))
            options = dict(options)
            if not c.v4:
                options[where.lower()] = values[6]
            user, tool = self._frames(options)

            def goal(start: Transform) -> Transform:
                pose = frames.in_frames(start, user, tool)
                if where == "Tool":
                    pose = pose @ offset
                else:
                    moved = pose.copy()
                    moved[:3, 3] += offset[:3, 3]
                    moved[:3, :3] = offset[:3, :3] @ pose[:3, :3]
                    pose = moved
                return frames.to_flange(pose, user, tool)

            if kind == "J":
                return self._to_joints(lambda j: self._near(goal(c.flange(j)), j), options)
            return self._along(lambda start: self._line_to(goal(start))(start), options)

        return run

    def place(self, values: Values, options: Options) -> str:
        """EmulatorPlace: what no arm can do, for a simulation that begins anew."""
        del options
        c = self.controller
        goal = frames.transform(np.array(values, dtype=float))
        solutions = c.geometry.all_solutions(goal)
        if not solutions:
            raise Failure(-1)
        # The branch of now, or else the nearest one.
        near = min(solutions, key=lambda s: float(np.sum((s - c.target) ** 2)))
        if not c.place(goal, near):
            raise Failure(-1)
        return ""

    def wait(self, values: Values, options: Options) -> str:
        """Wait."""
        del options
        return self.queued(lambda j: Delay(values[0] / 1e3))

    def jog(self, values: Values, options: Options) -> str:
        """MoveJog; without an axis it stops."""
        c = self.controller
        if not values or not values[0]:
            c.stop_jog()
            return ""
        axis, sign = values[0][:-1].upper(), {"+": 1.0, "-": -1.0}.get(values[0][-1])
        if sign is None or (c.v4 and values[0][:-1] != axis and axis not in ("RX", "RY", "RZ")):
            raise Failure(-40001)
        share = sign * c.speed_factor / 100.0
        if axis in {f"J{k}" for k in range(1, 7)}:
            rate = np.zeros(6)
            rate[int(axis[1]) - 1] = 0.25 * JOINT_SPEED * share
            motion = JogMotion(c.geometry, rate, None)
        elif axis in ("X", "Y", "Z", "RX", "RY", "RZ"):
            motion = JogMotion(c.geometry, None, self._twist(axis, share, options))
        else:
            raise Failure(-40001)
        if c.v4:
            c.jog(motion)
            return ""
        return self.queued(lambda j: motion)

    def servo_joints(self, values: Values, options: Options) -> str:
        """ServoJ."""
        return self._servo(np.radians(values[:6]), values[6:], options)

    def servo_pose(self, values: Values, options: Options) -> str:
        """ServoP."""
        c = self.controller
        joints = c.geometry.solve(self._pose(values[:6], options), c.target)
        if joints is None or np.max(np.abs(joints - c.target)) > np.pi:
            c.alarm(33)
            raise Failure(-1)
        return self._servo(joints, values[6:], options)

    def positive(self, values: Values, options: Options) -> str:
        """PositiveSolution, PositiveKin."""
        c = self.controller
        if len(values) >= 8:
            options = {"user": values[6], "tool": values[7]}
        flange = c.flange(np.radians(values[:6]))
        return self._written(frames.vector(frames.in_frames(flange, *self._frames(options))))

    def inverse(self, values: Values, options: Options) -> str:
        """InverseSolution, InverseKin."""
        c = self.controller
        near = c.joints
        if len(values) >= 8:
            if len(values) == 10 and values[8]:
                near = np.radians(values[9])
            options = {"user": values[6], "tool": values[7]}
        elif options.get("usejointnear") and "jointnear" in options:
            near = np.radians(options["jointnear"])
        try:
            joints = self._near(self._pose(values[:6], options), near)
        except Alarm as alarm:
            raise Failure(-1) from alarm
        return self._written(np.degrees(joints))

    # Their parts

    def _point(self, values: Values, options: Options, k: int) -> Transform:
        if "points" not in options:
            return self._pose(values[6 * k : 6 * k + 6], options)
        kind, vector = options["points"][k]
        if kind == "joint":
            return self.controller.flange(np.radians(vector))
        return self._pose(vector, options)

    def _line_to(self, goal: Transform) -> Callable[[Transform], tuple[Any, float]]:
        def path_from(start: Transform) -> tuple[Any, float]:
            way = float(np.linalg.norm(goal[:3, 3] - start[:3, 3]))
            cosine = (float(np.trace(goal[:3, :3] @ start[:3, :3].T)) - 1.0) / 2.0
            # A turn counts as a way of 0.3 m a radian, so that turning on the spot takes time.
            turn = 0.3 * float(np.arccos(np.clip(cosine, -1.0, 1.0)))
            return (lambda s: frames.line(start, goal, s)), max(way, turn)

        return path_from

    def _servo(self, target: Joints, rest: Values, options: Options) -> str:
        c = self.controller
        names = ("t", "aheadtime" if c.v4 else "lookahead_time", "gain")
        given = {**dict(zip(names, rest, strict=False)), **options}
        # V3's ServoP states no time, and what it takes is not documented.
        usual = SERVO_TIME if c.v4 or rest or options else c.options.servo_time
        try:
            c.aim(
                target,
                given.get("t", usual),
                given.get(names[1], LOOKAHEAD),
                given.get("gain", GAIN),
            )
        except Alarm as alarm:
            c.alarm(*alarm.numbers)
            raise Failure(-1) from alarm
        c.number += 1
        return str(c.number) if c.v4 and c.options.result_id else ""

    def _twist(self, axis: str, share: float, options: Options) -> np.ndarray:
        c = self.controller
        twist = np.zeros(6)
        turns = axis.startswith("R")
        k = "XYZ".index(axis[-1])
        twist[3 + k if turns else k] = (0.5 if turns else 0.25) * share
        if options.get("coordtype", 0) == (2 if c.v4 else 1):
            R = c.flange(c.target)[:3, :3]
            twist = np.concatenate([R @ twist[:3], R @ twist[3:]])
        return twist

    def _written(self, values: Any) -> str:
        return ",".join(f"{v:.{self.controller.options.decimals}f}" for v in values)

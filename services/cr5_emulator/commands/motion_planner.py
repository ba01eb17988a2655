"""Planner of the motion of a command, from the joint angles at which its turn comes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Values
from services.cr5_emulator.commands.io_ports import HIGHEST_OUTPUT, OUTPUT_COUNT, IoCommands
from services.cr5_emulator.commands.signature import Failure
from services.cr5_emulator.kinematics import Joints, Transform
from services.cr5_emulator.motions import (
    LINEAR_ACCELERATION,
    LINEAR_SPEED,
    Alarm,
    JointMotion,
    LineMotion,
    Motion,
    Trigger,
    TriggeredMotion,
)

ROTATION_LENGTH = 0.3
"""Path length that a rotation of 1 rad counts as, so that a pure rotation takes time [m]."""
Goal = Callable[[Joints], Joints]
"""Goal joint angles, given those at the start."""
Path = Callable[[float], Transform]
"""Flange pose at a progress from 0 to 1."""
PathFrom = Callable[[Transform], tuple[Path | None, float]]
"""Path and its length [m], given the flange pose at the start."""


class MotionPlanner:
    """Plans the motions of one controller."""

    def __init__(self, context: CommandContext, io_ports: IoCommands) -> None:
        self._context = context
        self._arm = context.controller
        self._io_ports = io_ports

    def rates(self, options: NamedValues, linear: bool) -> tuple[float, float]:
        """Return speed and acceleration as fractions of the maximum."""
        arm = self._arm
        letter = "l" if linear else "j"
        speed = options.get(f"speed{letter}", options.get("v", arm.ratios[f"speed{letter}"]))
        acceleration = options.get(f"acc{letter}", options.get("a", arm.ratios[f"acc{letter}"]))
        return speed / 100.0 * arm.speed_factor / 100.0, acceleration / 100.0

    def point(self, values: Values, options: NamedValues, k: int) -> Transform:
        """Return the flange pose in the base [m] of the k-th point of a command."""
        if "points" not in options:
            return self._context.flange(values[6 * k : 6 * k + 6], options)
        kind, vector = options["points"][k]
        if kind == "joint":
            return self._arm.flange(np.radians(vector))
        return self._context.flange(vector, options)

    def triggers(self, values: Values, options: NamedValues) -> tuple[Trigger, ...]:
        """Return the outputs that switch on the way: groups of mode, distance, output, state."""
        rest = values if "points" in options else values[6:]
        outputs = []
        for group in rest:
            if not isinstance(group, tuple):
                continue
            mode, distance, output, state = group
            percent = mode == 0 and abs(distance) > 100
            named = 1 <= output <= HIGHEST_OUTPUT or 100 <= output <= 1000
            if mode not in (0, 1) or state not in (0, 1) or percent or not named:
                raise Failure(-40002 if "points" in options else -40007)
            if output > OUTPUT_COUNT:
                raise Failure(-1)
            outputs.append(
                Trigger(
                    distance,
                    percent=mode == 0,
                    switch=lambda o=int(output), s=int(state): self._io_ports.set(o, s),
                )
            )
        return tuple(outputs)

    def to_joints(
        self, goal: Goal, options: NamedValues, triggers: tuple[Trigger, ...] = ()
    ) -> Callable[[Joints], Motion]:
        """Return a queue entry that moves all joints to a goal."""
        speed, acceleration = self.rates(options, linear=False)

        def start(joints: Joints) -> Motion:
            target = goal(joints)
            degrees = float(np.degrees(np.linalg.norm(target - joints)))
            motion = JointMotion(joints, target, speed, acceleration)
            return TriggeredMotion(motion, degrees, triggers) if triggers else motion

        return start

    def along(
        self, path_from: PathFrom, options: NamedValues, triggers: tuple[Trigger, ...] = ()
    ) -> Callable[[Joints], Motion]:
        """Return a queue entry that moves the flange along a path."""
        speed, acceleration = self.rates(options, linear=True)
        speed *= LINEAR_SPEED
        absolute = options.get("speed", self._arm.client_settings.tcp_speed)
        if absolute is not None:
            speed = absolute / 1e3

        def start(joints: Joints) -> Motion:
            path, length = path_from(self._arm.flange(joints))
            if path is None:
                raise Alarm(19)
            motion = LineMotion(
                self._arm.geometry,
                joints,
                path,
                length,
                speed,
                acceleration * LINEAR_ACCELERATION,
            )
            return TriggeredMotion(motion, 1e3 * length, triggers) if triggers else motion

        return start

    def line_to(self, goal: Transform) -> PathFrom:
        """Return a straight path to a flange pose."""

        def path_from(start: Transform) -> tuple[Path | None, float]:
            distance = float(np.linalg.norm(goal[:3, 3] - start[:3, 3]))
            cosine = (float(np.trace(goal[:3, :3] @ start[:3, :3].T)) - 1.0) / 2.0
            rotation = ROTATION_LENGTH * float(np.arccos(np.clip(cosine, -1.0, 1.0)))
            return (lambda s: frames.interpolate(start, goal, s)), max(distance, rotation)

        return path_from

    def goal(self, values: Values, options: NamedValues) -> Goal:
        """Return the goal joint angles of a command with one point."""
        if "points" in options and options["points"][0][0] == "joint":
            target = np.radians(options["points"][0][1])
            return lambda j: target
        pose = self.point(values, options, 0)
        return lambda j: self._context.nearest_solution(pose, j)

"""From the arguments of a motion command to a motion that begins when its turn comes."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.execution import Execution, Options, Values
from services.cr5_emulator.commands.outputs import LAST_OUTPUT, MOST_OUTPUT, Outputs
from services.cr5_emulator.commands.signature import Failure
from services.cr5_emulator.geometry import Joints, Transform
from services.cr5_emulator.motions import (
    LINEAR_ACCELERATION,
    LINEAR_SPEED,
    Alarm,
    JointMotion,
    LineMotion,
    Motion,
    Trigger,
    Triggered,
)

TURN_LENGTH = 0.3
"""Way that a turn of 1 rad counts as, so that turning on the spot takes time [m]."""
Goal = Callable[[Joints], Joints]
Path = Callable[[float], Transform]
PathFrom = Callable[[Transform], tuple[Path | None, float]]


class Planning:
    """Plans motions of one controller."""

    def __init__(self, execution: Execution, outputs: Outputs) -> None:
        self._do = execution
        self._arm = execution.controller
        self._outputs = outputs

    def rates(self, options: Options, linear: bool) -> tuple[float, float]:
        """Speed and acceleration as fractions."""
        arm = self._arm
        letter = "l" if linear else "j"
        speed = options.get(f"speed{letter}", options.get("v", arm.ratios[f"speed{letter}"]))
        acceleration = options.get(f"acc{letter}", options.get("a", arm.ratios[f"acc{letter}"]))
        return speed / 100.0 * arm.speed_factor / 100.0, acceleration / 100.0

    def point(self, values: Values, options: Options, k: int) -> Transform:
        """Flange in the base for the k-th point of a command [m]."""
        if "points" not in options:
            return self._do.flange(values[6 * k : 6 * k + 6], options)
        kind, vector = options["points"][k]
        if kind == "joint":
            return self._arm.flange(np.radians(vector))
        return self._do.flange(vector, options)

    def triggers(self, values: Values, options: Options) -> tuple[Trigger, ...]:
        """Outputs that switch on the way: mode, distance, output, state."""
        rest = values if "points" in options else values[6:]
        found = []
        for group in rest:
            if not isinstance(group, tuple):
                continue
            mode, distance, output, state = group
            percent = mode == 0 and abs(distance) > 100
            named = 1 <= output <= MOST_OUTPUT or 100 <= output <= 1000
            if mode not in (0, 1) or state not in (0, 1) or percent or not named:
                raise Failure(-40002 if "points" in options else -40007)
            if output > LAST_OUTPUT:
                raise Failure(-1)
            found.append(
                Trigger(
                    distance,
                    percent=mode == 0,
                    switch=lambda o=int(output), s=int(state): self._outputs.set(o, s),
                )
            )
        return tuple(found)

    def to_joints(
        self, goal: Goal, options: Options, triggers: tuple[Trigger, ...] = ()
    ) -> Callable[[Joints], Motion]:
        """Begins a motion of all joints to a goal."""
        speed, acceleration = self.rates(options, linear=False)

        def start(joints: Joints) -> Motion:
            target = goal(joints)
            degrees = float(np.degrees(np.linalg.norm(target - joints)))
            motion = JointMotion(joints, target, speed, acceleration)
            return Triggered(motion, degrees, triggers) if triggers else motion

        return start

    def along(
        self, path_from: PathFrom, options: Options, triggers: tuple[Trigger, ...] = ()
    ) -> Callable[[Joints], Motion]:
        """Begins a motion of the flange along a path."""
        speed, acceleration = self.rates(options, linear=True)
        speed *= LINEAR_SPEED
        absolute = options.get("speed", self._arm.preferences.tcp_speed)
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
            return Triggered(motion, 1e3 * length, triggers) if triggers else motion

        return start

    def line_to(self, goal: Transform) -> PathFrom:
        """A straight path to a pose of the flange."""

        def path_from(start: Transform) -> tuple[Path | None, float]:
            way = float(np.linalg.norm(goal[:3, 3] - start[:3, 3]))
            cosine = (float(np.trace(goal[:3, :3] @ start[:3, :3].T)) - 1.0) / 2.0
            turn = TURN_LENGTH * float(np.arccos(np.clip(cosine, -1.0, 1.0)))
            return (lambda s: frames.line(start, goal, s)), max(way, turn)

        return path_from

    def goal(self, values: Values, options: Options) -> Goal:
        """Joints for the one point of a command."""
        if "points" in options and options["points"][0][0] == "joint":
            target = np.radians(options["points"][0][1])
            return lambda j: target
        pose = self.point(values, options, 0)
        return lambda j: self._do.near(pose, j)

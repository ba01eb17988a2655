"""Commands of the arm's state: power, alarms, settings, outputs, poses."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    NUMBER,
    PERCENT,
    SIX_NUMBERS,
    SWITCH,
    WRONG_COUNT,
    Command,
    Failure,
    Parameter,
)
from services.cr5_emulator.controller import COLLISION_ALARM
from services.cr5_emulator.kinematics import Joints
from services.cr5_emulator.motions import Alarm
from shared.cr5.pose_vectors import Vector, vector_of

LOAD_MASS = Parameter("number", 0.0, 5.0)
"""Load at the flange [kg]."""
OUTPUT_PORT, INPUT_PORT, TOOL_PORT = (Parameter("integer", 1, most) for most in (16, 32, 2))


class StateCommands:
    """Commands that read or change the arm's state without moving it."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller

    def table(self) -> Table:
        """Return the commands by name."""
        arm, v4 = self._arm, self._context.v4
        now, in_order = self._context.run_now, self._context.run_in_order
        offset = Parameter("number", -999.0, 999.0) if v4 else Parameter("number", -500.0, 500.0)
        frame, near = self._context.frame_options, Parameter("six", key="jointnear")
        both = (*SIX_NUMBERS, self._context.index, self._context.index)
        at_once = "Instant" if v4 else "Execute"
        table = {
            "PowerOn": Command(lambda a, o: now(arm.power_on)),
            "EnableRobot": Command(
                lambda a, o: now(lambda: arm.enable(*a[:4])),
                optional=(LOAD_MASS, offset, offset, offset, SWITCH),
                counts=(0, 1, 4, 5) if v4 else (0, 1, 4),
            ),
            "DisableRobot": Command(lambda a, o: now(arm.disable)),
            "ClearError": Command(lambda a, o: now(arm.clear_alarms)),
            "Pause": Command(lambda a, o: now(arm.pause), since="3.5.7"),
            "Continue": Command(lambda a, o: now(arm.resume), since="3.5.7"),
            "StartDrag": Command(lambda a, o: self._start_drag()),
            "StopDrag": Command(lambda a, o: now(lambda: arm.set_dragging(0))),
            "RobotMode": Command(lambda a, o: str(arm.mode)),
            "GetErrorID": Command(lambda a, o: self._errors()),
            "SpeedFactor": Command(
                lambda a, o: now(lambda: self._set("speed_factor", a[0])), (PERCENT,)
            ),
            "AccJ": Command(self._ratio("accj"), (PERCENT,)),
            "AccL": Command(self._ratio("accl"), (PERCENT,)),
            "CP": Command(lambda a, o: "", (Parameter("integer", 0, 100),)),
            "SetCollisionLevel": Command(
                lambda a, o: in_order(lambda: self._set("collision_level", a[0])),
                (Parameter("integer", 0, 5),),
            ),
            "User": Command(lambda a, o: self._choose(a[0]), (self._context.index,)),
            "Tool": Command(lambda a, o: self._choose(a[0]), (self._context.index,)),
            "DO": Command(lambda a, o: in_order(lambda: arm.switch(*a)), (OUTPUT_PORT, SWITCH)),
            f"DO{at_once}": Command(
                lambda a, o: now(lambda: arm.switch(*a)), (OUTPUT_PORT, SWITCH)
            ),
            "ToolDO": Command(
                lambda a, o: in_order(lambda: arm.switch_tool(*a)), (TOOL_PORT, SWITCH)
            ),
            f"ToolDO{at_once}": Command(
                lambda a, o: now(lambda: arm.switch_tool(*a)), (TOOL_PORT, SWITCH)
            ),
            "DI": Command(lambda a, o: str(arm.inputs >> (a[0] - 1) & 1), (INPUT_PORT,)),
            "ToolDI": Command(lambda a, o: "0", (TOOL_PORT,)),
            "GetAngle": Command(lambda a, o: self._context.numbers(np.degrees(arm.joints))),
            "GetPose": Command(self._pose, (), frame, counts=(0,)),
        }
        if v4:
            return table | {
                "RequestControl": Command(lambda a, o: now(arm.request_control), since="4.6"),
                "Stop": Command(lambda a, o: now(arm.stop)),
                "EmergencyStop": Command(
                    lambda a, o: now(lambda: arm.press_emergency_stop(bool(a[0]))), (SWITCH,)
                ),
                "VelJ": Command(self._ratio("speedj"), (PERCENT,)),
                "VelL": Command(self._ratio("speedl"), (PERCENT,)),
                "SetPayload": Command(self._payload, (LOAD_MASS,), (offset,) * 3, counts=(1, 4)),
                "PositiveKin": Command(self._forward, SIX_NUMBERS, frame, counts=(6,)),
                "InverseKin": Command(
                    self._inverse,
                    SIX_NUMBERS,
                    (*frame, Parameter("integer", 0, 1, "usejointnear"), near),
                    counts=(6,),
                ),
            }
        return table | {
            "ResetRobot": Command(lambda a, o: now(arm.stop)),
            "EmergencyStop": Command(lambda a, o: now(arm.press_emergency_stop)),
            "SpeedJ": Command(self._ratio("speedj"), (PERCENT,)),
            "SpeedL": Command(self._ratio("speedl"), (PERCENT,)),
            "PayLoad": Command(self._payload, (LOAD_MASS, NUMBER)),
            "PositiveSolution": Command(self._forward, both),
            "InverseSolution": Command(self._inverse, both, (SWITCH, near), counts=(8, 9, 10)),
        }

    # Power and alarms

    def _start_drag(self) -> str:
        if not self._arm.enabled or self._arm.alarms:
            raise Failure(-1)
        return self._context.run_now(lambda: self._arm.set_dragging(1))

    def _errors(self) -> str:
        """List the alarms; V3 reports a collision as -2, and before 4.6 each drive has a list."""
        v3 = not self._context.v4
        ids = ",".join(str(-2 if v3 and a == COLLISION_ALARM else a) for a in self._arm.alarms)
        flat = self._context.options.version >= "4.6"
        return f"[{ids}]" if flat else f"[[{ids}],[],[],[],[],[],[]]"

    # Settings

    def _set(self, name: str, value: Any) -> None:
        setattr(self._arm, name, value)

    def _ratio(self, name: str) -> Callable[[Values, NamedValues], str]:
        return lambda a, o: self._context.run_now(lambda: self._arm.ratios.update({name: a[0]}))

    def _choose(self, index: int) -> str:
        """Choose a user or tool frame, of which only 0 is calibrated."""
        if self._arm.uncalibrated:
            raise Failure(-1)
        self._context.check_frames(index)
        return self._context.run_in_order(lambda: None)

    def _payload(self, values: Values, options: NamedValues) -> str:
        """Set the load; the inertia that V3 states second has no effect."""
        del options
        center = values[1:4] if len(values) == 4 else ()
        return self._context.run_in_order(lambda: self._arm.set_load(values[0], *center))

    # Poses

    def _pose(self, values: Values, options: NamedValues) -> str:
        del values
        if len(options) == 1:
            raise Failure(WRONG_COUNT)
        self._context.check_frames(*options.values())
        return self._context.numbers(self._vector(self._arm.joints))

    def _vector(self, joints: Joints) -> Vector:
        flange = self._arm.flange(joints)
        return vector_of(flange[:3, 3], flange[:3, :3])

    def _forward(self, values: Values, options: NamedValues) -> str:
        self._context.check_frames(*values[6:], *options.values())
        return self._context.numbers(self._vector(np.radians(values[:6])))

    def _inverse(self, values: Values, options: NamedValues) -> str:
        self._context.check_frames(*values[6:8], options.get("user", 0), options.get("tool", 0))
        near = self._arm.joints
        if len(values) == 10 and values[8]:
            near = np.radians(values[9])
        elif options.get("usejointnear") and "jointnear" in options:
            near = np.radians(options["jointnear"])
        goal = frames.transform(np.array(values[:6], dtype=float))
        try:
            joints = self._context.nearest_solution(goal, near)
        except Alarm as alarm:
            raise Failure(-1) from alarm
        return self._context.numbers(np.degrees(joints))

"""Commands that set speeds, loads, frames, and the reaction to collisions, walls and skin."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from services.cr5_emulator import frames
from services.cr5_emulator.command_parser import parse_number
from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    NUMBER,
    PERCENT,
    POSE,
    SWITCH,
    TEXT,
    Command,
    Failure,
    Parameter,
)
from services.cr5_emulator.motions import JOINT_RANGE

LOAD_MASS = Parameter("number", 0.0, 5.0)
"""Load at the flange [kg]."""


class SettingCommands:
    """Commands that set what later commands use."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        self.uncalibrated = False
        """Whether User and Tool fail."""

    def table(self) -> Table:
        """Return the commands by name."""
        context, arm = self._context, self._arm
        index = context.index
        # Frame 0 is the base or the flange; later firmware keeps it fixed.
        changeable = Parameter("integer", 1 if context.options.version >= "4.6" else 0, index.high)
        direction = Parameter("integer", 0, 1)
        return {
            "SpeedFactor": Command(lambda a, o: self._set("speed_factor", a[0]), (PERCENT,)),
            "AccJ": Command(self._ratio("accj"), (PERCENT,)),
            "AccL": Command(self._ratio("accl"), (PERCENT,)),
            "CP": Command(
                lambda a, o: self._keep("blending", a[0]), (Parameter("integer", 0, 100),)
            ),
            "SetCollisionLevel": self._ordered("collision_level", Parameter("integer", 0, 5)),
            "User": Command(lambda a, o: self._choose("user", a[0]), (index,)),
            "Tool": Command(lambda a, o: self._choose("tool", a[0]), (index,)),
            "SetUser": Command(
                self._define(arm.users), (changeable, POSE), (SWITCH,), since="3.5.7"
            ),
            "SetTool": Command(
                self._define(arm.tools), (changeable, POSE), (SWITCH,), since="3.5.7"
            ),
            "CalcUser": Command(
                self._calculate(arm.users), (index, direction, POSE), since="3.5.7"
            ),
            "CalcTool": Command(
                self._calculate(arm.tools), (index, direction, POSE), since="3.5.7"
            ),
            **(self._v4() if context.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        return {
            "SpeedJ": Command(self._ratio("speedj"), (PERCENT,)),
            "SpeedL": Command(self._ratio("speedl"), (PERCENT,)),
            "PayLoad": Command(self._payload, (LOAD_MASS, NUMBER)),
            "LoadSwitch": self._ordered("load_switch", SWITCH),
            "SetSafeSkin": Command(self._skin, (SWITCH,)),
            # Deprecated by the vendor, but still listed.
            "SetObstacleAvoid": Command(self._skin, (SWITCH,)),
            "Arch": Command(lambda a, o: "", (Parameter("integer", 0, 9),)),
            "LimZ": Command(lambda a, o: "", (NUMBER,)),
            "SetArmOrientation": Command(
                lambda a, o: "", (*(Parameter("integer", -1, 1),) * 3, Parameter("integer", -8, 8))
            ),
            "SetAxisLimit": Command(
                lambda a, o: self._axis_limit(a), (NUMBER,) * 12, since="3.5.7"
            ),
            "GetAxisLimit": Command(lambda a, o: self._axis_limits(), since="3.5.7"),
            "TCPSpeed": Command(
                lambda a, o: self._keep("tcp_speed", a[0]),
                (Parameter("number", 0.1, 100000),),
                since="3.5.5",
            ),
            "TCPSpeedEnd": Command(lambda a, o: self._keep("tcp_speed", None), since="3.5.5"),
            "SetTerminalKeys": Command(lambda a, o: "", (SWITCH,)),
        }

    def _v4(self) -> Table:
        return {
            "VelJ": Command(self._ratio("speedj"), (PERCENT,)),
            "VelL": Command(self._ratio("speedl"), (PERCENT,)),
            "SetPayload": Command(
                self._payload,
                (Parameter("any"),),
                (Parameter("number", -999, 999),) * 3,
                counts=(1, 4),
            ),
            "DragSensivity": Command(
                lambda a, o: "", (Parameter("integer", 0, 6), Parameter("integer", 1, 90))
            ),
            "EnableSafeSkin": Command(self._skin, (SWITCH,)),
            "SetSafeSkin": Command(self._skin, (Parameter("integer", 3, 6), self._level(3))),
            "SetPostCollisionMode": self._ordered("post_collision", SWITCH),
            "SetBackDistance": self._ordered("back_distance", Parameter("number", 0, 50)),
            "SetSafeWallEnable": Command(self._zone, (Parameter("integer", 1, 8), SWITCH)),
            "SetWorkZoneEnable": Command(self._zone, (Parameter("integer", 1, 6), SWITCH)),
        }

    def _level(self, most: int) -> Parameter:
        return Parameter("integer", 0, most)

    def _set(self, name: str, value: Any) -> str:
        setattr(self._arm, name, value)
        return ""

    def _keep(self, name: str, value: Any) -> str:
        setattr(self._arm.client_settings, name, value)
        return ""

    def _ordered(self, name: str, parameter: Parameter) -> Command:
        """Return a command that makes a setting in queue order."""
        return Command(
            lambda a, o: self._context.run_in_order(lambda: self._keep(name, a[0])), (parameter,)
        )

    def _ratio(self, name: str) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            self._arm.ratios[name] = int(values[0])
            return ""

        return run

    def _payload(self, values: Values, options: NamedValues) -> str:
        """Set the load in kilograms; V4 also accepts names of saved loads, of which none exists."""
        del options
        load = values[0]
        if isinstance(load, str):
            weight = parse_number(load)
            if weight is None:
                TEXT.read(load, -30001, -40001)
                raise Failure(-1 if len(values) == 1 else -30001)
            load = LOAD_MASS.read(load, -30001, -40001)

        def apply() -> None:
            self._arm.load = load
            if len(values) >= 4:
                self._arm.load_center = np.array(values[1:4])

        return self._context.run_in_order(apply)

    def _skin(self, values: Values, options: NamedValues) -> str:
        del options
        if not self._context.options.skin:
            raise Failure(-1)
        return self._context.run_in_order(lambda: self._keep("skin_on", bool(values[-1])))

    def _zone(self, values: Values, options: NamedValues) -> str:
        """Switch a safety wall or zone; none is defined, so switching one on fails."""
        del options
        if values[1]:
            raise Failure(-1)
        return self._context.run_in_order(lambda: None)

    # Frames

    def _choose(self, which: str, index: int) -> str:
        choices = self._arm.users if which == "user" else self._arm.tools
        if index not in choices or self.uncalibrated:
            raise Failure(-1)
        return self._context.run_in_order(lambda: self._set(which, index))

    def _define(self, where: dict[int, np.ndarray]) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            where[values[0]] = np.array(values[1])
            return ""

        return run

    def _calculate(self, where: dict[int, np.ndarray]) -> Callable[[Values, NamedValues], str]:
        """Return a command that offsets a frame in its parent (1) or in itself (0)."""

        def run(values: Values, options: NamedValues) -> str:
            del options
            index, along_parent, offset = values
            if index not in where:
                raise Failure(-1)
            frame, change = frames.transform(where[index]), frames.transform(np.array(offset))
            moved = change @ frame if along_parent else frame @ change
            return self._context.numbers(frames.vector(moved))

        return run

    # Joint limits

    def _axis_limit(self, values: Values) -> str:
        limits = np.radians(values).reshape(6, 2)
        too_wide = np.any(np.abs(limits) > JOINT_RANGE[:, None] + 1e-9)
        if self._arm.enabled or too_wide or np.any(limits[:, 0] >= limits[:, 1]):
            raise Failure(-1)
        return self._keep("axis_limits", limits)

    def _axis_limits(self) -> str:
        return self._context.numbers(np.degrees(self._arm.client_settings.axis_limits).ravel())

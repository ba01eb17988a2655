"""Commands of the force sensor and of force control.

The sensor reports the force of the tether, if there is one; nothing else touches the arm. Force
control has no effect on its motion; the arguments are checked and stored.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import (
    PERCENT,
    SWITCH,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.tether import Tether

SMALLEST_POSITIVE = 1e-9
"""Lower bound of a range that excludes 0."""
AXIS_SWITCHES = Parameter("list", 0, 1, count=6)
"""Whether force control acts, for each translation and rotation."""


def six_parameters(
    linear: tuple[float, float], angular: tuple[float, float]
) -> tuple[Parameter, ...]:
    """Return three parameters for translations and three for rotations, from their ranges."""
    return (Parameter("number", *linear),) * 3 + (Parameter("number", *angular),) * 3


class ForceControlCommands:
    """Force sensor at the flange, and the state of force control."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        self._tether = Tether.of(context.options.tether)
        self._zero = np.zeros(6)

    def table(self) -> Table:
        """Return the commands by name."""
        if not self._context.v4:
            return {"GetSixForceData": Command(lambda a, o: self._context.numbers(self._wrench()))}
        index = self._context.index
        limits = {
            "FCSetForceLimit": six_parameters((SMALLEST_POSITIVE, 500), (SMALLEST_POSITIVE, 50)),
            "FCSetMass": six_parameters((SMALLEST_POSITIVE, 10000), (SMALLEST_POSITIVE, 10000)),
            "FCSetStiffness": six_parameters((0, 10000), (0, 10000)),
            "FCSetDamping": six_parameters((0, 1000), (0, 1000)),
            "FCSetForceSpeedLimit": six_parameters(
                (SMALLEST_POSITIVE, 300), (SMALLEST_POSITIVE, 90)
            ),
            "FCSetForce": six_parameters((-200, 200), (-12, 12)),
        }
        commands = {
            "EnableFTSensor": Command(lambda a, o: self._sensor(), (SWITCH,)),
            "SixForceHome": Command(lambda a, o: self._home()),
            "GetForce": Command(lambda a, o: self._read(), (), (index,)),
            "ForceDriveMode": Command(lambda a, o: self._drive(), (AXIS_SWITCHES,), (index,)),
            "ForceDriveSpeed": Command(lambda a, o: self._keep("ForceDriveSpeed", a), (PERCENT,)),
            "FCForceMode": Command(
                self._control,
                (AXIS_SWITCHES, Parameter("list", -200, 200, count=6)),
                (option("reference", "integer", 0, 1), *self._context.frame_options),
                counts=(2,),
            ),
            "FCSetDeviation": Command(
                lambda a, o: self._keep("FCSetDeviation", a),
                (Parameter("list", SMALLEST_POSITIVE, 1000, count=6),),
                (SWITCH,),
            ),
            "FCOff": Command(lambda a, o: self._switch(False)),
            # Both need an arm with a built-in sensor.
            "SetFCCollision": Command(
                lambda a, o: self._absent(),
                (Parameter("number", 5, 150), Parameter("number", 0.5, 15)),
            ),
            "FCCollisionSwitch": Command(lambda a, o: self._absent(), (SWITCH,)),
            **{
                name: Command(lambda a, o, name=name: self._keep(name, a), parameters)
                for name, parameters in limits.items()
            },
        }
        return {n: Command(**{**vars(c), "since": "4.6"}) for n, c in commands.items()}

    def _wrench(self) -> np.ndarray:
        wrench = np.zeros(6)
        if self._tether is not None:
            flange = self._arm.flange(self._arm.joints)
            wrench[:3] = flange[:3, :3].T @ self._tether.force(flange)
        return wrench - self._zero

    def _absent(self) -> str:
        raise Failure(-1)

    def _sensor(self) -> str:
        if not self._context.options.force_sensor:
            raise Failure(-1)
        return ""

    def _home(self) -> str:
        self._sensor()
        self._zero = self._zero + self._wrench()
        return ""

    def _read(self) -> str:
        self._sensor()
        return self._context.numbers(self._wrench())

    def _drive(self) -> str:
        self._sensor()
        if not self._arm.enabled or self._arm.busy:
            raise Failure(-1)
        self._arm.set_dragging(2)
        return ""

    def _control(self, values: Values, options: NamedValues) -> str:
        if any(abs(f) > 12 for f in values[1][3:]):
            raise Failure(-40002)
        self._context.frames(options)
        return self._switch(True)

    def _switch(self, on: bool) -> str:
        self._sensor()
        return self._context.run_in_order(
            lambda: setattr(self._arm.client_settings, "force_control", on)
        )

    def _keep(self, name: str, values: list[Any]) -> str:
        self._sensor()
        self._arm.client_settings.force[name] = tuple(values)
        return ""

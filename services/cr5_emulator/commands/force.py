"""Force sensor and force control.

The emulated arm touches nothing but its tether, if it has one: that is what its sensor tells. Under
force control it therefore moves as it would without; what is set is checked and kept.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
from services.cr5_emulator.commands.signature import (
    PERCENT,
    SWITCH,
    Command,
    Failure,
    Parameter,
    option,
)
from services.cr5_emulator.load import Tether

SMALL = 1e-9
"""The least of a range that begins above 0."""
DIRECTIONS = Parameter("list", 0, 1, count=6)


def six(linear: tuple[float, float], angular: tuple[float, float]) -> tuple[Parameter, ...]:
    """Three numbers for directions and three for turns."""
    return (Parameter("number", *linear),) * 3 + (Parameter("number", *angular),) * 3


class Force:
    """The sensor at the flange."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._arm = execution.controller
        self._tether = Tether.of(execution.options.tether)
        self._zero = np.zeros(6)

    def table(self) -> Table:
        """Commands by name."""
        if not self._do.v4:
            return {"GetSixForceData": Command(lambda a, o: self._do.numbers(self._wrench()))}
        index = self._do.index
        limits = {
            "FCSetForceLimit": six((SMALL, 500), (SMALL, 50)),
            "FCSetMass": six((SMALL, 10000), (SMALL, 10000)),
            "FCSetStiffness": six((0, 10000), (0, 10000)),
            "FCSetDamping": six((0, 1000), (0, 1000)),
            "FCSetForceSpeedLimit": six((SMALL, 300), (SMALL, 90)),
            "FCSetForce": six((-200, 200), (-12, 12)),
        }
        commands = {
            "EnableFTSensor": Command(lambda a, o: self._sensor(), (SWITCH,)),
            "SixForceHome": Command(lambda a, o: self._home()),
            "GetForce": Command(lambda a, o: self._read(), (), (index,)),
            "ForceDriveMode": Command(lambda a, o: self._drive(), (DIRECTIONS,), (index,)),
            "ForceDriveSpeed": Command(lambda a, o: self._keep("ForceDriveSpeed", a), (PERCENT,)),
            "FCForceMode": Command(
                self._control,
                (DIRECTIONS, Parameter("list", -200, 200, count=6)),
                (option("reference", "integer", 0, 1), *self._do.frame_options),
                counts=(2,),
            ),
            "FCSetDeviation": Command(
                lambda a, o: self._keep("FCSetDeviation", a),
                (Parameter("list", SMALL, 1000, count=6),),
                (SWITCH,),
            ),
            "FCOff": Command(lambda a, o: self._switch(False)),
            # These two are for arms whose sensor is built in.
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
        if not self._do.options.force_sensor:
            raise Failure(-1)
        return ""

    def _home(self) -> str:
        self._sensor()
        self._zero = self._zero + self._wrench()
        return ""

    def _read(self) -> str:
        self._sensor()
        return self._do.numbers(self._wrench())

    def _drive(self) -> str:
        self._sensor()
        if not self._arm.enabled or self._arm.busy:
            raise Failure(-1)
        self._arm.drag(2)
        return ""

    def _control(self, values: Values, options: Options) -> str:
        if any(abs(f) > 12 for f in values[1][3:]):
            raise Failure(-40002)
        self._do.frames(options)
        return self._switch(True)

    def _switch(self, on: bool) -> str:
        self._sensor()
        return self._do.in_turn(lambda: setattr(self._arm.preferences, "force_control", on))

    def _keep(self, name: str, values: list[Any]) -> str:
        self._sensor()
        self._arm.preferences.force[name] = tuple(values)
        return ""

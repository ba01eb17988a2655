"""Power, enabling, stopping, alarms, hand guiding, scripts and logs."""

from __future__ import annotations

import numpy as np

from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
from services.cr5_emulator.commands.signature import SWITCH, TEXT, Command, Failure, Parameter
from services.cr5_emulator.controller import COLLISION
from services.cr5_emulator.motions import JointMotion

NO_STICK = 3
"""Of GetExportStatus: no USB stick is found."""
NEARLY = np.radians(1.0)
"""Deviation from the joints at the pause that counts as small [rad]."""


class Power:
    """The arm's state."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._arm = execution.controller
        self.not_tcp = False
        """Somebody took TCP control away."""
        self._exported = 0

    def table(self) -> Table:
        """Commands by name."""
        arm, now = self._arm, self._do.now
        offset = 999.0 if self._do.v4 else 500.0
        load = (Parameter("number", 0.0, 5.0), *(Parameter("number", -offset, offset),) * 3)
        counts = (0, 1, 4, 5) if self._do.v4 else (0, 1, 4)
        return {
            "PowerOn": Command(lambda a, o: self._worked(arm.power_on())),
            "EnableRobot": Command(self._enable, (), (*load, SWITCH), counts=counts),
            "DisableRobot": Command(lambda a, o: now(arm.disable)),
            "ClearError": Command(lambda a, o: now(arm.clear_alarms)),
            "Pause": Command(lambda a, o: now(arm.pause), since="3.5.7"),
            "Continue": Command(lambda a, o: now(arm.go_on), since="3.5.7"),
            "BrakeControl": Command(self._brake, (Parameter("integer", 1, 6), SWITCH)),
            "StartDrag": Command(lambda a, o: self._drag(1)),
            "StopDrag": Command(lambda a, o: self._drag(0)),
            "RobotMode": Command(lambda a, o: str(arm.mode)),
            "GetErrorID": Command(lambda a, o: self._errors()),
            "RunScript": Command(lambda a, o: self._worked(arm.run_script(a[0])), (TEXT,)),
            **(self._v4() if self._do.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        arm, now = self._arm, self._do.now
        return {
            "ResetRobot": Command(lambda a, o: now(arm.stop)),
            "EmergencyStop": Command(lambda a, o: now(arm.press)),
            "StopScript": Command(lambda a, o: now(arm.stop_script)),
            "PauseScript": Command(lambda a, o: self._worked(arm.pause_script(True))),
            "ContinueScript": Command(lambda a, o: self._worked(arm.pause_script(False))),
            "SetCollideDrag": Command(lambda a, o: self._drag(a[0], force=True), (SWITCH,)),
        }

    def _v4(self) -> Table:
        arm, now = self._arm, self._do.now
        return {
            "RequestControl": Command(lambda a, o: self._request_control(), since="4.6"),
            "Stop": Command(lambda a, o: now(arm.stop)),
            "EmergencyStop": Command(self._emergency, (SWITCH,)),
            "GetScrName": Command(lambda a, o: self._script_name(), since="4.6"),
            "SetResumeOffset": Command(lambda a, o: "", (Parameter(),), since="4.6"),
            "PathRecovery": Command(lambda a, o: self._recover_path(), since="4.6"),
            "PathRecoveryStop": Command(lambda a, o: now(arm.stop_single), since="4.6"),
            "PathRecoveryStatus": Command(lambda a, o: self._path_status(), since="4.6"),
            "LogExportUSB": Command(lambda a, o: self._export(), (SWITCH,), since="4.6"),
            "GetExportStatus": Command(lambda a, o: str(self._exported), since="4.6"),
        }

    def _worked(self, worked: bool) -> str:
        if not worked:
            raise Failure(-1)
        return ""

    def _enable(self, values: Values, options: Options) -> str:
        del options
        if not self._arm.enable():
            raise Failure(-1)
        if values:
            self._arm.load = values[0]
        if len(values) >= 4:
            self._arm.load_center = np.array(values[1:4])
        return ""

    def _brake(self, values: Values, options: Options) -> str:
        del options
        if self._arm.enabled or not self._arm.powered:
            raise Failure(-1)
        self._arm.brakes[values[0] - 1] = bool(values[1])
        return ""

    def _drag(self, how: int, force: bool = False) -> str:
        if how and (not self._arm.enabled or (self._arm.alarms and not force)):
            raise Failure(-1)
        self._arm.drag(how)
        return ""

    def _emergency(self, values: Values, options: Options) -> str:
        del options
        if values[0]:
            self._arm.press()
        else:
            self._arm.pressed = False
        return ""

    def _request_control(self) -> str:
        if self._arm.enabled or any(self._arm.brakes):
            raise Failure(-1)
        self.not_tcp = False
        return ""

    def _errors(self) -> str:
        """V3 calls a collision -2; 4.6 gave up the lists of the six drives."""
        v3 = not self._do.v4
        ids = ",".join(str(-2 if v3 and a == COLLISION else a) for a in self._arm.alarms)
        flat = self._do.options.version >= "4.6"
        return f"[{ids}]" if flat else f"[[{ids}],[],[],[],[],[],[]]"

    def _script_name(self) -> str:
        if not self._arm.script:
            raise Failure(-1)
        return f'"{self._arm.script}"'

    def _recover_path(self) -> str:
        arm = self._arm
        if arm.paused_at is None or not arm.enabled:
            raise Failure(-1)
        arm.move_alone(JointMotion(arm.target, arm.paused_at, 0.2, 0.5))
        return ""

    def _path_status(self) -> str:
        arm = self._arm
        if arm.paused_at is None:
            return "0"
        way = float(np.max(np.abs(arm.joints - arm.paused_at)))
        return "0" if way < 1e-3 else "1" if way < NEARLY else "2"

    def _export(self) -> str:
        self._exported = NO_STICK
        return ""

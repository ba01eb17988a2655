"""Commands of power, enabling, stopping, alarms, hand guiding, scripts and log export."""

from __future__ import annotations

import numpy as np

from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import SWITCH, TEXT, Command, Failure, Parameter
from services.cr5_emulator.controller import COLLISION_ALARM
from services.cr5_emulator.motions import JointMotion

NO_USB_STICK = 3
"""Answer of GetExportStatus: no USB stick is found."""
PAUSE_POSITION_TOLERANCE = 1e-3
"""Deviation from the joint angles at the pause that counts as none [rad]."""
SMALL_PAUSE_DEVIATION = np.radians(1.0)
"""Deviation from the joint angles at the pause that counts as small [rad]."""


class PowerCommands:
    """Commands that change the operating state of the arm."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        self.not_tcp = False
        """Whether the control mode is no longer TCP."""
        self._exported = 0

    def table(self) -> Table:
        """Return the commands by name."""
        arm, run_now = self._arm, self._context.run_now
        offset = 999.0 if self._context.v4 else 500.0
        load = (Parameter("number", 0.0, 5.0), *(Parameter("number", -offset, offset),) * 3)
        counts = (0, 1, 4, 5) if self._context.v4 else (0, 1, 4)
        return {
            "PowerOn": Command(lambda a, o: self._check_done(arm.power_on())),
            "EnableRobot": Command(self._enable, (), (*load, SWITCH), counts=counts),
            "DisableRobot": Command(lambda a, o: run_now(arm.disable)),
            "ClearError": Command(lambda a, o: run_now(arm.clear_alarms)),
            "Pause": Command(lambda a, o: run_now(arm.pause), since="3.5.7"),
            "Continue": Command(lambda a, o: run_now(arm.resume), since="3.5.7"),
            "BrakeControl": Command(self._brake, (Parameter("integer", 1, 6), SWITCH)),
            "StartDrag": Command(lambda a, o: self._drag(1)),
            "StopDrag": Command(lambda a, o: self._drag(0)),
            "RobotMode": Command(lambda a, o: str(arm.mode)),
            "GetErrorID": Command(lambda a, o: self._errors()),
            "RunScript": Command(lambda a, o: self._check_done(arm.run_script(a[0])), (TEXT,)),
            **(self._v4() if self._context.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        arm, run_now = self._arm, self._context.run_now
        return {
            "ResetRobot": Command(lambda a, o: run_now(arm.stop)),
            "EmergencyStop": Command(lambda a, o: run_now(arm.press_emergency_stop)),
            "StopScript": Command(lambda a, o: run_now(arm.stop_script)),
            "PauseScript": Command(lambda a, o: self._check_done(arm.pause_script(True))),
            "ContinueScript": Command(lambda a, o: self._check_done(arm.pause_script(False))),
            "SetCollideDrag": Command(lambda a, o: self._drag(a[0], force=True), (SWITCH,)),
        }

    def _v4(self) -> Table:
        arm, run_now = self._arm, self._context.run_now
        return {
            "RequestControl": Command(lambda a, o: self._request_control(), since="4.6"),
            "Stop": Command(lambda a, o: run_now(arm.stop)),
            "EmergencyStop": Command(self._emergency, (SWITCH,)),
            "GetScrName": Command(lambda a, o: self._script_name(), since="4.6"),
            "SetResumeOffset": Command(lambda a, o: "", (Parameter(),), since="4.6"),
            "PathRecovery": Command(lambda a, o: self._recover_path(), since="4.6"),
            "PathRecoveryStop": Command(lambda a, o: run_now(arm.stop_unqueued), since="4.6"),
            "PathRecoveryStatus": Command(lambda a, o: self._path_status(), since="4.6"),
            "LogExportUSB": Command(lambda a, o: self._export(), (SWITCH,), since="4.6"),
            "GetExportStatus": Command(lambda a, o: str(self._exported), since="4.6"),
        }

    def _check_done(self, done: bool) -> str:
        if not done:
            raise Failure(-1)
        return ""

    def _enable(self, values: Values, options: NamedValues) -> str:
        del options
        if not self._arm.enable():
            raise Failure(-1)
        if values:
            self._arm.load = values[0]
        if len(values) >= 4:
            self._arm.load_center = np.array(values[1:4])
        return ""

    def _brake(self, values: Values, options: NamedValues) -> str:
        del options
        if self._arm.enabled or not self._arm.powered:
            raise Failure(-1)
        self._arm.brakes[values[0] - 1] = bool(values[1])
        return ""

    def _drag(self, mode: int, force: bool = False) -> str:
        if mode and (not self._arm.enabled or (self._arm.alarms and not force)):
            raise Failure(-1)
        self._arm.set_dragging(mode)
        return ""

    def _emergency(self, values: Values, options: NamedValues) -> str:
        del options
        if values[0]:
            self._arm.press_emergency_stop()
        else:
            self._arm.pressed = False
        return ""

    def _request_control(self) -> str:
        if self._arm.enabled or any(self._arm.brakes):
            raise Failure(-1)
        self.not_tcp = False
        return ""

    def _errors(self) -> str:
        """List the alarms; V3 reports a collision as -2, and before 4.6 each drive has a list."""
        v3 = not self._context.v4
        ids = ",".join(str(-2 if v3 and a == COLLISION_ALARM else a) for a in self._arm.alarms)
        flat = self._context.options.version >= "4.6"
        return f"[{ids}]" if flat else f"[[{ids}],[],[],[],[],[],[]]"

    def _script_name(self) -> str:
        if not self._arm.script:
            raise Failure(-1)
        return f'"{self._arm.script}"'

    def _recover_path(self) -> str:
        arm = self._arm
        if arm.paused_at is None or not arm.enabled:
            raise Failure(-1)
        arm.start_unqueued(JointMotion(arm.target, arm.paused_at, 0.2, 0.5))
        return ""

    def _path_status(self) -> str:
        arm = self._arm
        if arm.paused_at is None:
            return "0"
        deviation = float(np.max(np.abs(arm.joints - arm.paused_at)))
        return (
            "0"
            if deviation < PAUSE_POSITION_TOLERANCE
            else "1"
            if deviation < SMALL_PAUSE_DEVIATION
            else "2"
        )

    def _export(self) -> str:
        self._exported = NO_USB_STICK
        return ""

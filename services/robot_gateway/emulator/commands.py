"""The commands of V3 and V4, over one controller."""

from __future__ import annotations

from typing import Any

import numpy as np

from services.robot_gateway.emulator import frames
from services.robot_gateway.emulator.controller import Controller
from services.robot_gateway.emulator.grammar import Call, reply
from services.robot_gateway.emulator.motions import JOINT_RANGE
from services.robot_gateway.emulator.moves import Moves
from services.robot_gateway.emulator.signature import (
    NO_SUCH_COMMAND,
    Command,
    Failure,
    Parameter,
)

MOTION_PORT = 30003
"""Of V3; V4 takes everything on 29999."""
IN_ALARM = {
    "clearerror",
    "geterrorid",
    "emergencystop",
    "stop",
    "robotmode",
    "logexportusb",
    "getexportstatus",
}
"""What V4 still carries out in alarm or emergency stop."""

INDEX = Parameter("integer", 0, 9)
SWITCH = Parameter("integer", 0, 1)
PERCENT = Parameter("number", 1, 100)
NUMBER = Parameter()
SIX = (NUMBER,) * 6


def option(key: str, kind: Any = "number", low: float = -1e9, high: float = 1e9) -> Parameter:
    """An optional argument."""
    return Parameter(kind, low, high, key)


class Commands:
    """Answers calls."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.v4 = controller.v4
        self.not_tcp = False
        """Somebody took TCP control away."""
        self.uncalibrated = False
        """User and Tool fail."""
        self._registers: dict[tuple[int, int], int] = {}
        self._masters = 0
        self._moves = Moves(controller)
        self.table = {name.lower(): c for name, c in self._table().items()}

    def answer(self, call: Call, port: int) -> str | None:
        """The reply to a call; None when it comes later (Sync)."""
        if self.not_tcp and call.name.lower() != "requestcontrol":
            return "Control Mode Is Not Tcp"
        try:
            command = self._find(call, port)
            values, options = command.read(call, self.v4)
            self._check_state(call.name.lower(), command)
            result = command.run(values, options)
        except Failure as failure:
            return reply(failure.code, "", call)
        return None if result is None else reply(0, result, call)

    def _find(self, call: Call, port: int) -> Command:
        command = self.table.get(call.name.lower())
        if command is None or (not self.v4 and command.port != port):
            raise Failure(NO_SUCH_COMMAND)
        return command

    def _check_state(self, name: str, command: Command) -> None:
        c = self.controller
        if self.v4 and name not in IN_ALARM:
            if c.pressed:
                raise Failure(-3)
            if c.alarms:
                raise Failure(-2)
            if not c.powered and name not in ("poweron", "requestcontrol"):
                raise Failure(-4)
        if command.moves and (not c.enabled or c.alarms or c.dragging):
            raise Failure(-1)

    # Tables

    def _table(self) -> dict[str, Command]:
        return {**self._common(), **(self._v4() if self.v4 else self._v3())}

    def _common(self) -> dict[str, Command]:
        c, m = self.controller, self._moves
        offset = 999.0 if self.v4 else 500.0
        load = (Parameter("number", 0.0, 5.0), *(Parameter("number", -offset, offset),) * 3)
        output = Parameter("integer", 1, 16)
        tool_output = Parameter("integer", 1, 2)
        return {
            "PowerOn": Command(lambda a, o: self._done(c.power_on())),
            "EnableRobot": Command(
                self._enable, (), (*load, SWITCH), (0, 1, 4, 5) if self.v4 else (0, 1, 4)
            ),
            "DisableRobot": Command(lambda a, o: self._do(c.disable)),
            "ClearError": Command(lambda a, o: self._do(c.clear_alarms)),
            "Pause": Command(lambda a, o: self._pause(True)),
            "Continue": Command(lambda a, o: self._pause(False)),
            "BrakeControl": Command(self._brake, (Parameter("integer", 1, 6), SWITCH)),
            "StartDrag": Command(lambda a, o: self._drag(True)),
            "StopDrag": Command(lambda a, o: self._drag(False)),
            "SetCollisionLevel": Command(
                lambda a, o: self._set("collision_level", a[0]), (Parameter("integer", 0, 5),)
            ),
            "SetSafeSkin": Command(
                lambda a, o: "", (Parameter("integer", 3, 6), INDEX) if self.v4 else (SWITCH,)
            ),
            "SpeedFactor": Command(
                lambda a, o: self._set("speed_factor", a[0]), (Parameter("integer", 1, 100),)
            ),
            "User": Command(lambda a, o: self._choose("user", a[0]), (INDEX,)),
            "Tool": Command(lambda a, o: self._choose("tool", a[0]), (INDEX,)),
            "SetUser": Command(
                lambda a, o: self._define(c.users, a),
                (INDEX, Parameter("list", count=6)),
                (SWITCH,),
            ),
            "SetTool": Command(
                lambda a, o: self._define(c.tools, a),
                (INDEX, Parameter("list", count=6)),
                (SWITCH,),
            ),
            "AccJ": Command(lambda a, o: self._ratio("accj", a[0]), (PERCENT,)),
            "AccL": Command(lambda a, o: self._ratio("accl", a[0]), (PERCENT,)),
            "CP": Command(lambda a, o: "", (Parameter("number", 0, 100),)),
            "RobotMode": Command(lambda a, o: str(c.mode)),
            "GetPose": Command(
                self._pose, (), (option("user", "integer", 0, 9), option("tool", "integer", 0, 9))
            ),
            "GetAngle": Command(lambda a, o: self._numbers(np.degrees(c.joints))),
            "GetErrorID": Command(lambda a, o: self._errors()),
            "DI": Command(lambda a, o: str(c.inputs >> (a[0] - 1) & 1), (output,)),
            "ToolDI": Command(lambda a, o: "0", (tool_output,)),
            "AI": Command(lambda a, o: self._numbers([0.0]), (tool_output,)),
            "ToolAI": Command(lambda a, o: self._numbers([0.0]), (tool_output,)),
            "DO": Command(
                lambda a, o: self._queue_output(a), (output, SWITCH), self._pulse(), None
            ),
            "ToolDO": Command(lambda a, o: self._queue_tool(a), (tool_output, SWITCH)),
            "AO": Command(lambda a, o: self._analog(a), (tool_output, Parameter("number", 0, 10))),
            "GetHoldRegs": Command(
                self._get_registers,
                (INDEX, Parameter("integer", 0, 65535), Parameter("integer", 1, 4)),
                (Parameter("text"),),
            ),
            "SetHoldRegs": Command(
                self._set_registers,
                (
                    INDEX,
                    Parameter("integer", 0, 65535),
                    Parameter("integer", 1, 4),
                    Parameter("list"),
                ),
                (Parameter("text"),),
            ),
            "ModbusCreate": Command(
                self._master,
                (Parameter("text"), Parameter("integer", 1, 65535), Parameter("integer", 0, 255)),
                (SWITCH,),
            ),
            "ModbusClose": Command(lambda a, o: self._close_master(), (INDEX,)),
            "EmulatorPlace": Command(m.place, SIX),
            "RunScript": Command(lambda a, o: self._fail(-1), (Parameter("text"),)),
            "ServoJ": self._motion(m.servo_joints, SIX, m.servo_options(False)),
            "ServoP": self._motion(m.servo_pose, SIX, m.servo_options(True)),
        }

    def _v3(self) -> dict[str, Command]:
        c, m = self.controller, self._moves
        joint, linear, frame = m.v3_options()
        relative = {
            f"RelMov{kind}{where}": self._motion(
                m.relative(kind, where), (*SIX, INDEX), joint if kind == "J" else linear
            )
            for kind in "JL"
            for where in ("User", "Tool")
        }
        output = Parameter("integer", 1, 16)
        return {
            "ResetRobot": Command(lambda a, o: self._do(c.stop)),
            "EmergencyStop": Command(lambda a, o: self._do(c.press)),
            "StopScript": Command(lambda a, o: ""),
            "PauseScript": Command(lambda a, o: ""),
            "ContinueScript": Command(lambda a, o: ""),
            "SpeedJ": Command(lambda a, o: self._ratio("speedj", a[0]), (PERCENT,)),
            "SpeedL": Command(lambda a, o: self._ratio("speedl", a[0]), (PERCENT,)),
            "PayLoad": Command(self._payload, (Parameter("number", 0, 5), NUMBER)),
            "LoadSwitch": Command(lambda a, o: "", (SWITCH,)),
            "SetCollideDrag": Command(lambda a, o: self._drag(bool(a[0]), force=True), (SWITCH,)),
            "SetArmOrientation": Command(
                lambda a, o: "", (Parameter("integer", -1, 1),) * 4, counts=(4,)
            ),
            "SetAxisLimit": Command(lambda a, o: self._axis_limit(), (NUMBER,) * 12),
            "GetAxisLimit": Command(
                lambda a, o: self._numbers([x for k in range(6) for x in self._range(k)])
            ),
            "SetTerminal485": Command(
                lambda a, o: "",
                (Parameter("integer", 1200, 4000000), Parameter("integer", 5, 8)),
                (Parameter("text"), Parameter("integer", 1, 2)),
            ),
            "TCPSpeed": Command(lambda a, o: "", (Parameter("number", 0.1, 100000),)),
            "TCPSpeedEnd": Command(lambda a, o: ""),
            "DOExecute": Command(lambda a, o: self._output(a), (output, SWITCH)),
            "ToolDOExecute": Command(
                lambda a, o: self._tool_output(a), (Parameter("integer", 1, 2), SWITCH)
            ),
            "AOExecute": Command(
                lambda a, o: self._analog(a), (Parameter("integer", 1, 2), Parameter("number", 0))
            ),
            "DOGroup": Command(
                self._output_group, (output, SWITCH), (output, SWITCH) * 31, tuple(range(2, 65, 2))
            ),
            "PositiveSolution": Command(m.positive, (*SIX, INDEX, INDEX)),
            "InverseSolution": Command(
                m.inverse,
                (*SIX, INDEX, INDEX),
                (SWITCH, Parameter("list", count=6)),
                (8, 9, 10),
            ),
            "MovJ": self._motion(m.joint_to_pose, SIX, (*frame, *joint)),
            "JointMovJ": self._motion(m.joint_to_joints, SIX, joint),
            "MovL": self._motion(m.line, SIX, (*frame, *linear)),
            "Arc": self._motion(m.arc, SIX * 2, (*frame, *linear)),
            "Circle3": self._motion(
                m.circle, (*SIX * 2, Parameter("integer", 1, 999)), (*frame, *linear)
            ),
            "RelJointMovJ": self._motion(m.relative_joints, SIX, joint),
            **relative,
            "MoveJog": self._motion(m.jog, (), (Parameter("text"), *m.jog_options())),
            "Sync": Command(lambda a, o: None, port=MOTION_PORT),
            "Wait": self._motion(m.wait, (Parameter("integer", 1, 3_600_000),), ()),
        }

    def _v4(self) -> dict[str, Command]:
        c, m = self.controller, self._moves
        common = m.v4_options()
        relative = {
            f"RelMov{kind}{where}": self._motion(m.relative(kind, where), SIX, common)
            for kind in "JL"
            for where in ("User", "Tool")
        }
        output = Parameter("integer", 1, 16)
        return {
            "RequestControl": Command(lambda a, o: self._request_control()),
            "Stop": Command(lambda a, o: self._do(c.stop)),
            "EmergencyStop": Command(self._emergency, (SWITCH,)),
            "VelJ": Command(lambda a, o: self._ratio("speedj", a[0]), (PERCENT,)),
            "VelL": Command(lambda a, o: self._ratio("speedl", a[0]), (PERCENT,)),
            "SetPayload": Command(
                self._payload,
                (Parameter("number", 0, 5),),
                (Parameter("number", -999, 999),) * 3,
                (1, 4),
            ),
            "EnableSafeSkin": Command(lambda a, o: "", (SWITCH,)),
            "SetPostCollisionMode": Command(lambda a, o: "", (SWITCH,)),
            "SetBackDistance": Command(lambda a, o: "", (Parameter("number", 0, 50),)),
            "SetSafeWallEnable": Command(lambda a, o: "", (Parameter("integer", 1, 8), SWITCH)),
            "SetWorkZoneEnable": Command(lambda a, o: "", (Parameter("integer", 1, 6), SWITCH)),
            "SetToolMode": Command(
                lambda a, o: "", (Parameter("integer", 1, 2), INDEX), (Parameter("integer", 1, 2),)
            ),
            "SetTool485": Command(
                lambda a, o: "",
                (Parameter("integer", 1200, 4000000),),
                (Parameter("text"), Parameter("integer", 1, 2), Parameter("integer", 1, 2)),
            ),
            "ModbusRTUCreate": Command(
                self._master,
                (Parameter("integer", 0, 255), Parameter("integer", 1200, 4000000)),
                (Parameter("text"), Parameter("integer", 5, 8), Parameter("integer", 1, 2)),
            ),
            "DOInstant": Command(lambda a, o: self._output(a), (output, SWITCH)),
            "GetDO": Command(lambda a, o: str(c.outputs >> (a[0] - 1) & 1), (output,)),
            "ToolDOInstant": Command(
                lambda a, o: self._tool_output(a), (Parameter("integer", 1, 2), SWITCH)
            ),
            "AOInstant": Command(
                lambda a, o: self._analog(a), (Parameter("integer", 1, 2), Parameter("number", 0))
            ),
            "DOGroup": Command(
                self._output_group, (output, SWITCH), (output, SWITCH) * 31, tuple(range(2, 65, 2))
            ),
            "PositiveKin": Command(m.positive, SIX, m.frame_options(), (6,)),
            "InverseKin": Command(
                m.inverse,
                SIX,
                (
                    *m.frame_options(),
                    option("usejointnear", "integer", 0, 1),
                    Parameter("list", key="jointnear", count=6),
                ),
                (6,),
            ),
            "GetCurrentCommandID": Command(lambda a, o: str(c.finished)),
            "MovJ": self._motion(m.joint_to_pose, (), common, points=1),
            "MovL": self._motion(m.line, (), common, points=1),
            "Arc": self._motion(m.arc, (), common, points=2),
            "Circle": self._motion(m.circle, (Parameter("integer", 1, 999),), common, points=2),
            "RelJointMovJ": self._motion(m.relative_joints, SIX, common),
            **relative,
            "MoveJog": self._motion(m.jog, (), (Parameter("text"), *m.jog_options())),
        }

    def _motion(
        self,
        run: Any,
        required: tuple[Parameter, ...],
        optional: tuple[Parameter, ...],
        points: int = 0,
    ) -> Command:
        # ServoP on V3 takes no options; everything else may have them positionally too.
        return Command(
            run,
            required,
            optional,
            points=points,
            port=29999 if self.v4 else MOTION_PORT,
            moves=True,
        )

    # What they do

    def _do(self, action: Any) -> str:
        action()
        return ""

    def _done(self, worked: bool) -> str:
        return "" if worked else self._fail(-1)

    def _fail(self, code: int) -> str:
        raise Failure(code)

    def _set(self, name: str, value: int) -> str:
        setattr(self.controller, name, value)
        return ""

    def _numbers(self, values: Any) -> str:
        return ",".join(f"{v:.{self.controller.options.decimals}f}" for v in values)

    def _enable(self, values: list[Any], options: dict[str, Any]) -> str:
        if not self.controller.enable():
            raise Failure(-1)
        if values:
            self._payload(values, options)
        return ""

    def _payload(self, values: list[Any], options: dict[str, Any]) -> str:
        del options
        self.controller.load = values[0]
        if len(values) >= 4:
            self.controller.load_center = np.array(values[1:4])
        return ""

    def _pause(self, pause: bool) -> str:
        self.controller.paused = pause and self.controller.enabled
        if not pause:
            self.controller.queue_running = True
        return ""

    def _brake(self, values: list[Any], options: dict[str, Any]) -> str:
        del options
        if self.controller.enabled or not self.controller.powered:
            raise Failure(-1)
        self.controller.brakes[values[0] - 1] = bool(values[1])
        return ""

    def _drag(self, on: bool, force: bool = False) -> str:
        c = self.controller
        if on and (not c.enabled or (c.alarms and not force)):
            raise Failure(-1)
        c.stop()
        c.dragging = on
        return ""

    def _emergency(self, values: list[Any], options: dict[str, Any]) -> str:
        del options
        if values[0]:
            self.controller.press()
        else:
            self.controller.pressed = False
        return ""

    def _request_control(self) -> str:
        if self.controller.enabled:
            raise Failure(-1)
        self.not_tcp = False
        return ""

    def _choose(self, which: str, index: int) -> str:
        known = self.controller.users if which == "user" else self.controller.tools
        if index not in known or self.uncalibrated:
            raise Failure(-1)
        return self._set(which, index)

    def _define(self, where: dict[int, np.ndarray], values: list[Any]) -> str:
        where[values[0]] = np.array(values[1])
        return ""

    def _ratio(self, name: str, value: float) -> str:
        self.controller.ratios[name] = int(value)
        return ""

    def _pose(self, values: list[Any], options: dict[str, Any]) -> str:
        c = self.controller
        if values or len(options) == 1:
            raise Failure(-20000)
        user, tool = options.get("user", c.user), options.get("tool", c.tool)
        if user not in c.users or tool not in c.tools:
            raise Failure(-1)
        T = frames.in_frames(c.flange(c.joints), c.users[user], c.tools[tool])
        return self._numbers(frames.vector(T))

    def _errors(self) -> str:
        ids = ",".join(str(a) for a in self.controller.alarms)
        return f"[{ids}]" if self.v4 else f"[[{ids}],[],[],[],[],[],[]]"

    def _pulse(self) -> tuple[Parameter, ...]:
        return (Parameter("integer", 25, 60000),) if self.v4 else ()

    def _output(self, values: list[Any]) -> str:
        bit = 1 << (values[0] - 1)
        c = self.controller
        c.outputs = c.outputs | bit if values[1] else c.outputs & ~bit
        return ""

    def _tool_output(self, values: list[Any]) -> str:
        self.controller.tool_outputs[values[0] - 1] = values[1]
        return ""

    def _queue_output(self, values: list[Any]) -> str:
        return self._moves.queued(lambda joints: self._nothing(self._output(values)))

    def _queue_tool(self, values: list[Any]) -> str:
        return self._moves.queued(lambda joints: self._nothing(self._tool_output(values)))

    def _nothing(self, _: str) -> None:
        return None

    def _output_group(self, values: list[Any], options: dict[str, Any]) -> str:
        del options
        for index, status in zip(values[::2], values[1::2], strict=True):
            self._output([index, status])
        return ""

    def _analog(self, values: list[Any]) -> str:
        self.controller.analog[values[0] - 1] = values[1]
        return ""

    def _axis_limit(self) -> str:
        return self._fail(-1) if self.controller.enabled else ""

    def _range(self, k: int) -> tuple[float, float]:
        most = float(np.degrees(JOINT_RANGE[k]))
        return -most, most

    def _master(self, values: list[Any], options: dict[str, Any]) -> str:
        del values, options
        if self._masters >= 5:
            raise Failure(-1)
        self._masters += 1
        return str(self._masters - 1)

    def _close_master(self) -> str:
        if self._masters == 0:
            raise Failure(-1)
        self._masters -= 1
        return ""

    def _get_registers(self, values: list[Any], options: dict[str, Any]) -> str:
        del options
        index, start, count = values[:3]
        found = (self._registers.get((index, start + k), 0) for k in range(count))
        return ",".join(str(v) for v in found)

    def _set_registers(self, values: list[Any], options: dict[str, Any]) -> str:
        del options
        index, start, count, given = values[:4]
        for k, value in enumerate(given[:count]):
            self._registers[index, start + k] = int(value)
        return ""

"""Dispatch of calls: find the command, parse its arguments, check the arm's state, run it."""

from __future__ import annotations

from services.cr5_emulator.command_parser import Call, format_reply
from services.cr5_emulator.commands.context import CommandContext
from services.cr5_emulator.commands.direct_motion import DirectMotionCommands
from services.cr5_emulator.commands.io_ports import IoCommands
from services.cr5_emulator.commands.kinematics_queries import KinematicsCommands
from services.cr5_emulator.commands.permissions import (
    DURING_PAUSED_SCRIPT,
    DURING_SCRIPT,
    IN_ALARM,
    WITHOUT_POWER,
)
from services.cr5_emulator.commands.power import PowerCommands
from services.cr5_emulator.commands.queued_motion import QueuedMotionCommands
from services.cr5_emulator.commands.settings import SettingCommands
from services.cr5_emulator.commands.signature import NO_SUCH_COMMAND, Command, Failure
from services.cr5_emulator.controller import Controller


class CommandDispatcher:
    """Dispatcher of calls to the commands of a controller's firmware."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.v4 = controller.v4
        self._release = controller.options.version
        context = CommandContext(controller)
        self.power, self.settings = PowerCommands(context), SettingCommands(context)
        io_ports = IoCommands(context)
        groups = (
            self.power,
            self.settings,
            io_ports,
            KinematicsCommands(context),
            QueuedMotionCommands(context, io_ports),
            DirectMotionCommands(context),
        )
        self.table: dict[str, Command] = {
            name.lower(): command
            for group in groups
            for name, command in group.table().items()
            if command.since <= self._release
        }

    def answer(self, call: Call, port: int) -> str | None:
        """Run a call and return its reply; None when the reply comes later (Sync)."""
        if self.power.not_tcp and call.name.lower() != "requestcontrol":
            return "Control Mode Is Not Tcp"
        try:
            command = self._find(call, port)
            values, options = command.read(call, self.v4)
            self._check_state(call.name.lower(), command)
            result = command.run(values, options)
        except Failure as failure:
            return self._refusal(failure.code, call)
        if self._release < "3.5.2":
            return call.text
        return None if result is None else format_reply(0, result, call)

    def _refusal(self, code: int, call: Call) -> str:
        if self._release < "3.5.2":
            return f"could not understand: '{call.text}'"
        return format_reply(code, "", call)

    def _find(self, call: Call, port: int) -> Command:
        command = self.table.get(call.name.lower())
        if command is None or port not in command.ports:
            raise Failure(NO_SUCH_COMMAND)
        return command

    def _check_state(self, name: str, command: Command) -> None:
        arm = self.controller
        if self.v4:
            if name not in IN_ALARM and arm.pressed:
                raise Failure(-3)
            if name not in IN_ALARM and arm.alarms:
                raise Failure(-2)
            if name not in WITHOUT_POWER and not arm.powered:
                raise Failure(-4)
            self._check_script(name)
        if command.moves and (not arm.enabled or arm.alarms or arm.dragging):
            raise Failure(-1)

    def _check_script(self, name: str) -> None:
        arm = self.controller
        if not arm.script:
            return
        if arm.paused:
            if name not in DURING_PAUSED_SCRIPT:
                raise Failure(-7 if self._release >= "4.6" else -1)
        elif name not in DURING_SCRIPT:
            raise Failure(-5)

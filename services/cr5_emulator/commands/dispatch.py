"""Dispatch of calls: find the command, parse its arguments, check the arm's state, run it."""

from __future__ import annotations

from services.cr5_emulator.command_parser import Call, format_reply
from services.cr5_emulator.commands.context import CommandContext
from services.cr5_emulator.commands.motion import MotionCommands
from services.cr5_emulator.commands.signature import NO_SUCH_COMMAND, Command, Failure
from services.cr5_emulator.commands.state import StateCommands
from services.cr5_emulator.controller import Controller

IN_ALARM = {"clearerror", "geterrorid", "emergencystop", "stop", "robotmode"}
"""Commands that V4 accepts in an alarm."""
WITHOUT_POWER = IN_ALARM | {"poweron", "requestcontrol"}
"""Commands that V4 accepts without power."""


class CommandDispatcher:
    """Dispatcher of calls to the commands of a controller's firmware."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self._release = controller.options.version
        context = CommandContext(controller)
        self.table: dict[str, Command] = {
            name.lower(): command
            for group in (StateCommands(context), MotionCommands(context))
            for name, command in group.table().items()
            if command.since <= self._release
        }

    def answer(self, call: Call, port: int) -> str | None:
        """Run a call and return its reply; None when the reply comes later (Sync)."""
        if self.controller.not_tcp and call.name.lower() != "requestcontrol":
            return "Control Mode Is Not Tcp"
        try:
            command = self.table.get(call.name.lower())
            if command is None or port != command.port:
                raise Failure(NO_SUCH_COMMAND)
            values, options = command.read(call, self.controller.v4)
            self._check_state(call.name.lower(), command)
            result = command.run(values, options)
        except Failure as failure:
            if self._release < "3.5.2":
                return f"could not understand: '{call.text}'"
            return format_reply(failure.code, "", call)
        if self._release < "3.5.2":
            return call.text
        return None if result is None else format_reply(0, result, call)

    def _check_state(self, name: str, command: Command) -> None:
        arm = self.controller
        if arm.v4:
            if name not in IN_ALARM and arm.pressed:
                raise Failure(-3)
            if name not in IN_ALARM and arm.alarms:
                raise Failure(-2)
            if name not in WITHOUT_POWER and not arm.powered:
                raise Failure(-4)
        if command.moves and (not arm.enabled or arm.alarms or arm.dragging):
            raise Failure(-1)

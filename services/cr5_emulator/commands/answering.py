"""Answers calls: finds the command, reads its arguments, minds the arm's state, carries it out."""

from __future__ import annotations

from services.cr5_emulator.commands.allowed import (
    BESIDE_PAUSED_SCRIPT,
    BESIDE_SCRIPT,
    IN_ALARM,
    WITHOUT_POWER,
)
from services.cr5_emulator.commands.execution import Execution
from services.cr5_emulator.commands.following import Following
from services.cr5_emulator.commands.force import Force
from services.cr5_emulator.commands.moves import Moves
from services.cr5_emulator.commands.outputs import Outputs
from services.cr5_emulator.commands.positions import Positions
from services.cr5_emulator.commands.power import Power
from services.cr5_emulator.commands.registers import Registers
from services.cr5_emulator.commands.settings import Settings
from services.cr5_emulator.commands.signature import NO_SUCH_COMMAND, Command, Failure
from services.cr5_emulator.commands.traces import Traces
from services.cr5_emulator.commands.trays import Trays
from services.cr5_emulator.controller import Controller
from services.cr5_emulator.grammar import Call, reply


class Commands:
    """The commands of one controller's firmware."""

    def __init__(self, controller: Controller) -> None:
        self.controller = controller
        self.v4 = controller.v4
        self._release = controller.options.version
        execution = Execution(controller)
        self.power, self.settings = Power(execution), Settings(execution)
        outputs = Outputs(execution)
        groups = (
            self.power,
            self.settings,
            Force(execution),
            outputs,
            Registers(execution),
            Positions(execution),
            Trays(execution),
            Moves(execution, outputs),
            Following(execution),
            Traces(execution),
        )
        self.table: dict[str, Command] = {
            name.lower(): command
            for group in groups
            for name, command in group.table().items()
            if command.since <= self._release
        }

    def answer(self, call: Call, port: int) -> str | None:
        """The reply to a call; None when it comes later (Sync)."""
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
        return None if result is None else reply(0, result, call)

    def _refusal(self, code: int, call: Call) -> str:
        if self._release < "3.5.2":
            return f"could not understand: '{call.text}'"
        return reply(code, "", call)

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
            if name not in BESIDE_PAUSED_SCRIPT:
                raise Failure(-7 if self._release >= "4.6" else -1)
        elif name not in BESIDE_SCRIPT:
            raise Failure(-5)

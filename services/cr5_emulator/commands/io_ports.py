"""Commands of the inputs and outputs of controller and tool."""

from __future__ import annotations

from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.signature import SWITCH, Command, Failure, Parameter

OUTPUT_COUNT = 16
"""Outputs of the controller; ports from 100 on are those of an extension, which is absent."""
HIGHEST_OUTPUT = 24
"""Highest port that a list of outputs may name; other controllers have more outputs."""
OUTPUT_PORT = Parameter("integer", 1, OUTPUT_COUNT, second_range=(100, 1000))
INPUT_PORT = Parameter("integer", 1, 32, second_range=(100, 1000))
TOOL_PORT = Parameter("integer", 1, 2)
OUTPUT_PORTS = Parameter("list", 1, HIGHEST_OUTPUT)
PARITY = Parameter("text", words=("N", "O", "E"))
BAUD_RATE = Parameter("integer", 1200, 4000000)
ONE_OR_TWO = Parameter("integer", 1, 2)


class IoCommands:
    """States of inputs and outputs, and the serial port of the tool."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._arm = context.controller
        self._serial = "115200, 8, N, 1"

    def table(self) -> Table:
        """Return the commands by name."""
        context = self._context
        # On V4 a current output goes up to 20 mA.
        level = Parameter("number", 0, 20 if context.v4 else 10)
        pulse = (Parameter("integer", 25, 60000),) if context.v4 else ()
        at_once = "Instant" if context.v4 else "Execute"
        return {
            "DO": Command(self._pulse, (OUTPUT_PORT, SWITCH), pulse),
            f"DO{at_once}": Command(
                lambda a, o: context.run_now(lambda: self.set(*a)), (OUTPUT_PORT, SWITCH)
            ),
            "ToolDO": Command(
                lambda a, o: context.run_in_order(lambda: self._set_tool(*a)), (TOOL_PORT, SWITCH)
            ),
            f"ToolDO{at_once}": Command(
                lambda a, o: context.run_now(lambda: self._set_tool(*a)), (TOOL_PORT, SWITCH)
            ),
            "AO": Command(
                lambda a, o: context.run_in_order(lambda: self._analog(*a)), (TOOL_PORT, level)
            ),
            f"AO{at_once}": Command(
                lambda a, o: context.run_now(lambda: self._analog(*a)), (TOOL_PORT, level)
            ),
            "DOGroup": Command(self._group, group=(OUTPUT_PORT, SWITCH)),
            "DI": Command(lambda a, o: self._inputs(a), (INPUT_PORT,)),
            "DIGroup": Command(lambda a, o: self._inputs(a), group=(INPUT_PORT,)),
            "ToolDI": Command(lambda a, o: "0", (TOOL_PORT,)),
            "AI": Command(lambda a, o: context.numbers([0.0]), (TOOL_PORT,)),
            "ToolAI": Command(lambda a, o: context.numbers([0.0]), (TOOL_PORT,)),
            **(self._v4() if context.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        return {
            "SetTerminal485": Command(
                self._set_serial, (BAUD_RATE, Parameter("integer", 5, 8), PARITY, ONE_OR_TWO)
            ),
            "GetTerminal485": Command(lambda a, o: self._serial),
        }

    def _v4(self) -> Table:
        context, arm = self._context, self._arm
        return {
            "GetDO": Command(lambda a, o: self._states(a), (OUTPUT_PORT,)),
            "GetDOGroup": Command(lambda a, o: self._states(a), group=(OUTPUT_PORT,)),
            "DOGroupDEC": Command(
                self._group_decimal, (OUTPUT_PORTS, Parameter("integer", 0, 2**24)), since="4.6"
            ),
            "GetDOGroupDEC": Command(
                lambda a, o: self._decimal(arm.outputs, a[0]), (OUTPUT_PORTS,), since="4.6"
            ),
            "DIGroupDEC": Command(
                lambda a, o: self._decimal(arm.inputs, a[0]), (OUTPUT_PORTS,), since="4.6"
            ),
            "GetToolDO": Command(lambda a, o: str(arm.tool_outputs[a[0] - 1]), (TOOL_PORT,)),
            "GetAO": Command(lambda a, o: context.numbers([arm.analog[a[0] - 1]]), (TOOL_PORT,)),
            "SetTool485": Command(lambda a, o: "", (BAUD_RATE,), (PARITY, ONE_OR_TWO, ONE_OR_TWO)),
            "SetToolPower": Command(lambda a, o: "", (SWITCH,), (ONE_OR_TWO,)),
            "SetToolMode": Command(
                lambda a, o: "", (ONE_OR_TWO,), (Parameter("integer", 0, 22), ONE_OR_TWO)
            ),
        }

    def set(self, port: int, on: int) -> None:
        """Switch one output; raises Failure when the arm has none of that number."""
        self._check_exists(port)
        bit = 1 << (port - 1)
        self._arm.outputs = self._arm.outputs | bit if on else self._arm.outputs & ~bit

    def _check_exists(self, port: int) -> None:
        if port > OUTPUT_COUNT:
            raise Failure(-1)

    def _pulse(self, values: Values, options: NamedValues) -> str:
        """Switch in queue order, and back after a time in milliseconds if one is given."""
        del options
        port, on, *time = values
        self._check_exists(port)

        def switch() -> None:
            self.set(port, on)
            if time:
                self._arm.schedule(time[0] / 1e3, lambda: self.set(port, 1 - on))

        return self._context.run_in_order(switch)

    def _set_tool(self, port: int, on: int) -> None:
        self._arm.tool_outputs[port - 1] = on

    def _analog(self, port: int, level: float) -> None:
        self._arm.analog[port - 1] = level

    def _group(self, values: Values, options: NamedValues) -> str:
        """Switch several outputs: at once on V3, in queue order on V4."""
        del options
        pairs = list(zip(values[::2], values[1::2], strict=True))
        for port, _ in pairs:
            self._check_exists(port)

        def switch() -> None:
            for port, on in pairs:
                self.set(port, on)

        return (
            self._context.run_in_order(switch)
            if self._context.v4
            else self._context.run_now(switch)
        )

    def _group_decimal(self, values: Values, options: NamedValues) -> str:
        """Switch outputs by the bits of a number; the lowest bit is for the port named first."""
        del options
        ports, decimal = values
        for port in ports:
            self._check_exists(int(port))

        def switch() -> None:
            for k, port in enumerate(ports):
                self.set(int(port), decimal >> k & 1)

        return self._context.run_in_order(switch)

    def _inputs(self, ports: list[int]) -> str:
        if max(ports) >= 100:
            raise Failure(-1)
        return ",".join(str(self._arm.inputs >> (p - 1) & 1) for p in ports)

    def _states(self, ports: list[int]) -> str:
        for port in ports:
            self._check_exists(port)
        return ",".join(str(self._arm.outputs >> (p - 1) & 1) for p in ports)

    def _decimal(self, bits: int, ports: tuple[float, ...]) -> str:
        return str(sum((bits >> (int(p) - 1) & 1) << k for k, p in enumerate(ports)))

    def _set_serial(self, values: Values, options: NamedValues) -> str:
        del options
        self._serial = ", ".join(str(v) for v in values)
        return ""

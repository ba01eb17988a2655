"""Inputs and outputs of the controller and of the tool."""

from __future__ import annotations

from services.cr5_emulator.commands.execution import Execution, Options, Table, Values
from services.cr5_emulator.commands.signature import SWITCH, Command, Failure, Parameter

LAST_OUTPUT = 16
"""Of a controller's own; above 99 it would be an extension's, which this one has not."""
MOST_OUTPUT = 24
"""That a list of outputs may name: other controllers have more."""
PORT = Parameter("integer", 1, LAST_OUTPUT, also=(100, 1000))
INPUT = Parameter("integer", 1, 32, also=(100, 1000))
TOOL_PORT = Parameter("integer", 1, 2)
PORTS = Parameter("list", 1, MOST_OUTPUT)
PARITY = Parameter("text", words=("N", "O", "E"))
BAUD = Parameter("integer", 1200, 4000000)
ONE_OR_TWO = Parameter("integer", 1, 2)


class Outputs:
    """What is wired to the arm."""

    def __init__(self, execution: Execution) -> None:
        self._do = execution
        self._arm = execution.controller
        self._serial = "115200, 8, N, 1"

    def table(self) -> Table:
        """Commands by name."""
        do = self._do
        # Amperes on V4 go up to 20 mA.
        level = Parameter("number", 0, 20 if do.v4 else 10)
        pulse = (Parameter("integer", 25, 60000),) if do.v4 else ()
        at_once = "Instant" if do.v4 else "Execute"
        return {
            "DO": Command(self._pulse, (PORT, SWITCH), pulse),
            f"DO{at_once}": Command(lambda a, o: do.now(lambda: self.set(*a)), (PORT, SWITCH)),
            "ToolDO": Command(
                lambda a, o: do.in_turn(lambda: self._set_tool(*a)), (TOOL_PORT, SWITCH)
            ),
            f"ToolDO{at_once}": Command(
                lambda a, o: do.now(lambda: self._set_tool(*a)), (TOOL_PORT, SWITCH)
            ),
            "AO": Command(lambda a, o: do.in_turn(lambda: self._analog(*a)), (TOOL_PORT, level)),
            f"AO{at_once}": Command(
                lambda a, o: do.now(lambda: self._analog(*a)), (TOOL_PORT, level)
            ),
            "DOGroup": Command(self._group, group=(PORT, SWITCH)),
            "DI": Command(lambda a, o: self._inputs(a), (INPUT,)),
            "DIGroup": Command(lambda a, o: self._inputs(a), group=(INPUT,)),
            "ToolDI": Command(lambda a, o: "0", (TOOL_PORT,)),
            "AI": Command(lambda a, o: do.numbers([0.0]), (TOOL_PORT,)),
            "ToolAI": Command(lambda a, o: do.numbers([0.0]), (TOOL_PORT,)),
            **(self._v4() if do.v4 else self._v3()),
        }

    def _v3(self) -> Table:
        return {
            "SetTerminal485": Command(
                self._set_serial, (BAUD, Parameter("integer", 5, 8), PARITY, ONE_OR_TWO)
            ),
            "GetTerminal485": Command(lambda a, o: self._serial),
        }

    def _v4(self) -> Table:
        do, arm = self._do, self._arm
        return {
            "GetDO": Command(lambda a, o: self._states(a), (PORT,)),
            "GetDOGroup": Command(lambda a, o: self._states(a), group=(PORT,)),
            "DOGroupDEC": Command(
                self._group_decimal, (PORTS, Parameter("integer", 0, 2**24)), since="4.6"
            ),
            "GetDOGroupDEC": Command(
                lambda a, o: self._decimal(arm.outputs, a[0]), (PORTS,), since="4.6"
            ),
            "DIGroupDEC": Command(
                lambda a, o: self._decimal(arm.inputs, a[0]), (PORTS,), since="4.6"
            ),
            "GetToolDO": Command(lambda a, o: str(arm.tool_outputs[a[0] - 1]), (TOOL_PORT,)),
            "GetAO": Command(lambda a, o: do.numbers([arm.analog[a[0] - 1]]), (TOOL_PORT,)),
            "SetTool485": Command(lambda a, o: "", (BAUD,), (PARITY, ONE_OR_TWO, ONE_OR_TWO)),
            "SetToolPower": Command(lambda a, o: "", (SWITCH,), (ONE_OR_TWO,)),
            "SetToolMode": Command(
                lambda a, o: "", (ONE_OR_TWO,), (Parameter("integer", 0, 22), ONE_OR_TWO)
            ),
        }

    def set(self, port: int, on: int) -> None:
        """Switches one output."""
        self._own(port)
        bit = 1 << (port - 1)
        self._arm.outputs = self._arm.outputs | bit if on else self._arm.outputs & ~bit

    def _own(self, port: int) -> None:
        if port > LAST_OUTPUT:
            raise Failure(-1)

    def _pulse(self, values: Values, options: Options) -> str:
        """Switches in its turn, and back again after so many milliseconds if that is said."""
        del options
        port, on, *time = values
        self._own(port)

        def switch() -> None:
            self.set(port, on)
            if time:
                self._arm.later(time[0] / 1e3, lambda: self.set(port, 1 - on))

        return self._do.in_turn(switch)

    def _set_tool(self, port: int, on: int) -> None:
        self._arm.tool_outputs[port - 1] = on

    def _analog(self, port: int, level: float) -> None:
        self._arm.analog[port - 1] = level

    def _group(self, values: Values, options: Options) -> str:
        """V3 does it at once, V4 in its turn."""
        del options
        pairs = list(zip(values[::2], values[1::2], strict=True))
        for port, _ in pairs:
            self._own(port)

        def switch() -> None:
            for port, on in pairs:
                self.set(port, on)

        return self._do.in_turn(switch) if self._do.v4 else self._do.now(switch)

    def _group_decimal(self, values: Values, options: Options) -> str:
        """The lowest bit is for the port that is named first."""
        del options
        ports, decimal = values
        for port in ports:
            self._own(int(port))

        def switch() -> None:
            for k, port in enumerate(ports):
                self.set(int(port), decimal >> k & 1)

        return self._do.in_turn(switch)

    def _inputs(self, ports: list[int]) -> str:
        if max(ports) >= 100:
            raise Failure(-1)
        return ",".join(str(self._arm.inputs >> (p - 1) & 1) for p in ports)

    def _states(self, ports: list[int]) -> str:
        for port in ports:
            self._own(port)
        return ",".join(str(self._arm.outputs >> (p - 1) & 1) for p in ports)

    def _decimal(self, bits: int, ports: tuple[float, ...]) -> str:
        return str(sum((bits >> (int(p) - 1) & 1) << k for k, p in enumerate(ports)))

    def _set_serial(self, values: Values, options: Options) -> str:
        del options
        self._serial = ", ".join(str(v) for v in values)
        return ""

"""Commands of Modbus and field bus registers; they are plain memory, as nothing is connected."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from services.cr5_emulator.commands.context import CommandContext, NamedValues, Table, Values
from services.cr5_emulator.commands.io_ports import BAUD_RATE, ONE_OR_TWO, PARITY
from services.cr5_emulator.commands.signature import (
    NUMBER,
    SWITCH,
    TEXT,
    Command,
    Failure,
    Parameter,
)

MASTER_COUNT = 5
"""Largest number of Modbus masters."""
MASTER_INDEX = Parameter("integer", 0, MASTER_COUNT - 1)
REGISTER_ADDRESS = Parameter("integer", 0, 65535)
SLAVE_ID = Parameter("integer", 0, 255)
BIT_COUNT, WORD_COUNT = Parameter("integer", 1, 16), Parameter("integer", 1, 4)
WORD_FORMAT = Parameter("text", words=("U16", "U32", "F32", "F64"))
REGISTER_VALUES = Parameter("list")
INTEGER_32_BIT = Parameter("integer", -(2**31), 2**31 - 1)


class RegisterCommands:
    """Four kinds of registers for each Modbus master, three for each direction of the field bus."""

    def __init__(self, context: CommandContext) -> None:
        self._context = context
        self._masters: set[int] = set()
        self._modbus: dict[tuple[str, int, int], float] = {}
        self._bus: dict[tuple[str, int], float] = {}

    def table(self) -> Table:
        """Return the commands by name."""
        get, put = self._get, self._put
        connect = Command(
            self._connect, (TEXT, Parameter("integer", 1, 65535), SLAVE_ID), (SWITCH,)
        )
        commands = {
            "ModbusCreate": connect,
            "ModbusClose": Command(self._close, (MASTER_INDEX,)),
            "GetInBits": Command(get("bits"), (MASTER_INDEX, REGISTER_ADDRESS, BIT_COUNT)),
            "GetInRegs": Command(
                get("inputs"), (MASTER_INDEX, REGISTER_ADDRESS, WORD_COUNT), (WORD_FORMAT,)
            ),
            "GetCoils": Command(get("coils"), (MASTER_INDEX, REGISTER_ADDRESS, BIT_COUNT)),
            "SetCoils": Command(
                put("coils"), (MASTER_INDEX, REGISTER_ADDRESS, BIT_COUNT, REGISTER_VALUES)
            ),
            "GetHoldRegs": Command(
                get("holding"), (MASTER_INDEX, REGISTER_ADDRESS, WORD_COUNT), (WORD_FORMAT,)
            ),
            "SetHoldRegs": Command(
                put("holding"),
                (MASTER_INDEX, REGISTER_ADDRESS, WORD_COUNT, REGISTER_VALUES),
                (WORD_FORMAT,),
            ),
        }
        return {**commands, **self._v4()} if self._context.v4 else commands

    def _v4(self) -> Table:
        kinds = (
            ("Bool", 63, SWITCH),
            ("Int", 23, INTEGER_32_BIT),
            ("Float", 23, NUMBER),
        )
        fields: Table = {}
        for kind, last, value in kinds:
            address = Parameter("integer", 0, last)
            for side in ("Input", "Output"):
                fields[f"Get{side}{kind}"] = Command(self._read(side + kind), (address,))
            fields[f"SetOutput{kind}"] = Command(self._write(f"Output{kind}"), (address, value))
        return {
            "ModbusRTUCreate": Command(
                self._connect,
                (SLAVE_ID, BAUD_RATE),
                (PARITY, Parameter("integer", 5, 8), ONE_OR_TWO),
            ),
            "SetSingleCoil": Command(
                self._put_one("coils"), (MASTER_INDEX, REGISTER_ADDRESS, SWITCH), since="4.6"
            ),
            "SetSingleHoldReg": Command(
                self._put_one("holding"), (MASTER_INDEX, REGISTER_ADDRESS, NUMBER), since="4.6"
            ),
            **fields,
        }

    # Modbus

    def _connect(self, values: Values, options: NamedValues) -> str:
        del values, options
        free = [k for k in range(MASTER_COUNT) if k not in self._masters]
        if not free:
            raise Failure(-1)
        self._masters.add(free[0])
        return str(free[0])

    def _close(self, values: Values, options: NamedValues) -> str:
        del options
        self._check(values[0])
        self._masters.remove(values[0])
        return ""

    def _check(self, master: int) -> None:
        if master not in self._masters:
            raise Failure(-1)

    def _get(self, kind: str) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            master, address, count = values[:3]
            self._check(master)
            found = (self._modbus.get((kind, master, address + k), 0) for k in range(count))
            return ",".join(f"{v:g}" for v in found)

        return run

    def _put(self, kind: str) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            master, address, count, given = values[:4]
            self._check(master)
            if len(given) != count:
                raise Failure(-1)
            self._modbus |= {(kind, master, address + k): v for k, v in enumerate(given)}
            return ""

        return run

    def _put_one(self, kind: str) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            master, address, value = values
            return self._put(kind)([master, address, 1, (int(value) & 0xFFFF,)], options)

        return run

    # Field bus

    def _read(self, field: str) -> Callable[[Values, NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            value = self._bus.get((field, values[0]), 0)
            return self._context.numbers([value]) if field.endswith("Float") else str(value)

        return run

    def _write(self, field: str) -> Callable[[list[Any], NamedValues], str]:
        def run(values: Values, options: NamedValues) -> str:
            del options
            self._bus[field, values[0]] = values[1]
            return ""

        return run

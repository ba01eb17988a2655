"""A client of the emulated arm that sends text and reads text."""

from __future__ import annotations

import numpy as np

from services.cr5_emulator.connection import Connection
from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import EmulatorOptions
from shared.cr5.packet import PacketReader


class Bench:
    """An emulator with one client on every port."""

    def __init__(self, firmware: str = "v3", **options: object) -> None:
        self.v4 = firmware == "v4"
        self.emulator = Emulator(EmulatorOptions(**{"firmware": firmware, **options}))
        self.commands = self.connect(29999)
        self.motion = self.commands if self.v4 else self.connect(30003)
        self.feedback = self.connect(30004)
        self.reader = PacketReader()
        self.now = 0.0

    def connect(self, port: int) -> Connection:
        connection = self.emulator.connect(port)
        assert connection is not None
        return connection

    def ask(self, text: str, motion: bool = False) -> str:
        """Everything that comes back at once."""
        connection = self.motion if motion else self.commands
        connection.feed(text.encode())
        self.emulator.process()
        return read(connection)

    def run(self, seconds: float) -> list[np.ndarray]:
        """Packets of the next so many seconds."""
        packets = []
        for _ in range(round(seconds / 0.008)):
            self.now += 0.008
            self.emulator.advance_to(self.now)
            while (segment := self.feedback.take()) is not None:
                packet = self.reader.feed(segment)
                if packet is not None:
                    packets.append(packet)
        return packets

    def enable(self) -> None:
        assert self.ask("EnableRobot()") == "0,{},EnableRobot();"


def read(connection: Connection) -> str:
    parts = []
    while (segment := connection.take()) is not None:
        parts.append(segment.decode())
    return "".join(parts)

"""Emulated CR5 arms in memory, on simulated time: what the gateway gets in place of TCP."""

from __future__ import annotations

from services.cr5_emulator.connection import Connection
from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import Options
from services.robot_gateway.drivers.cr5.link import ByteStream, StreamState
from shared.scenario import SIDES, Scenario, Side
from shared.service import SECOND

BOOT_TIME = SECOND
"""Time before the first step at which an emulated arm is switched on [ns]."""


class MemoryStream:
    """One connection to an emulated arm."""

    def __init__(self, connection: Connection | None, port: int) -> None:
        """Args: connection: None when the arm refused it."""
        self._connection, self._port = connection, port

    @property
    def state(self) -> StreamState:
        return "closed" if self._connection is None or self._connection.closed else "open"

    @property
    def reason(self) -> str:
        return f"emulator:{self._port}: refused or closed"

    def send(self, data: bytes) -> None:
        if self._connection is not None:
            self._connection.feed(data)

    def receive(self) -> bytes:
        parts = []
        while self._connection is not None and (segment := self._connection.take()) is not None:
            parts.append(segment)
        return b"".join(parts)

    def close(self) -> None:
        if self._connection is not None:
            self._connection.close()

    def abort(self) -> None:
        self.close()


class MemoryLink:
    """The ports of an emulated arm, which is stepped by the gateway's clock."""

    live = False

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator

    def open(self, port: int) -> ByteStream:
        return MemoryStream(self.emulator.connect(port), port)

    def advance(self, now: int) -> None:
        self.emulator.advance_to(now * 1e-9)


def emulated_links(scenario: Scenario, first_step: int) -> dict[Side, MemoryLink]:
    """Links to one emulated arm for each CR5 of a scenario, standing at the scenario's start.

    Args:
        scenario: The cell; an address in it is not used.
        first_step: Time of the gateway's first step [ns].

    Raises:
        ConfigurationError: The start is out of an arm's reach.
    """
    start = (first_step - BOOT_TIME) * 1e-9
    links: dict[Side, MemoryLink] = {}
    for side in SIDES:
        if scenario.end(side).driver == "cr5":
            links[side] = MemoryLink(Emulator(_options(scenario, side), start))
    return links


def _options(scenario: Scenario, side: Side) -> Options:
    # Only a cell with such an arm needs Pinocchio.
    from shared.cr5.installation import scenario_joints, tether_of

    end = scenario.end(side)
    return Options(
        firmware=end.firmware,
        calibrated=end.calibrated,
        joints=scenario_joints(scenario, side),
        tether=tether_of(scenario, side),
    )

"""Emulated CR5 arms in memory, in simulated time, which replace TCP connections."""

from __future__ import annotations

from lariat.scenario import SIDES, Scenario, Side
from lariat.trajectory import SECOND
from services.cr5_emulator.connection import Connection
from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import EmulatorOptions
from services.robot_gateway.drivers.cr5.link import ByteStream, StreamState

BOOT_TIME = SECOND
"""Time before the first step at which an emulated arm is switched on [ns]."""


class MemoryStream:
    """Connection to one port of an emulated arm."""

    def __init__(self, connection: Connection | None, port: int) -> None:
        """Create a stream.

        Args:
            connection: Connection of the emulator; None if it refused.
            port: Port of the arm.
        """
        self._connection, self._port = connection, port

    @property
    def state(self) -> StreamState:
        """Whether the connection is open."""
        return "closed" if self._connection is None or self._connection.closed else "open"

    @property
    def reason(self) -> str:
        """Reason why the connection is closed."""
        return f"emulator:{self._port}: refused or closed"

    def send(self, data: bytes) -> None:
        """Send bytes to the arm."""
        if self._connection is not None:
            self._connection.feed(data)

    def receive(self) -> bytes:
        """Return the bytes that the arm has sent since the last call."""
        parts = []
        while self._connection is not None and (segment := self._connection.take()) is not None:
            parts.append(segment)
        return b"".join(parts)

    def close(self) -> None:
        """Close the connection."""
        if self._connection is not None:
            self._connection.close()

    def abort(self) -> None:
        """Close the connection at once."""
        self.close()


class MemoryLink:
    """Link to an emulated arm, which advances with the gateway's steps."""

    live = False
    """Whether the arm runs in real time."""

    def __init__(self, emulator: Emulator) -> None:
        self.emulator = emulator
        """The arm."""

    def open(self, port: int) -> ByteStream:
        """Return a new connection to a port of the arm."""
        return MemoryStream(self.emulator.connect(port), port)

    def advance(self, now: int) -> None:
        """Advance the arm to the time of a step [ns]."""
        self.emulator.advance_to(now * 1e-9)

    def guard(self, stream: ByteStream | None, commands: tuple[str, str], moving: bool) -> None:
        """Do nothing: the arm and the gateway are one process."""

    def close(self) -> None:
        """Do nothing: there is no guard."""


def emulated_links(scenario: Scenario, first_step: int) -> dict[Side, MemoryLink]:
    """Return a link to an emulated arm for each CR5 of a scenario, at the scenario's start.

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


def _options(scenario: Scenario, side: Side) -> EmulatorOptions:
    # Imported late: only a cell with such an arm needs Pinocchio.
    from lariat.arms.cr5_installation import scenario_joints, tether_of

    end = scenario.end(side)
    return EmulatorOptions(
        firmware=end.firmware,
        calibrated=end.calibrated,
        joints=scenario_joints(scenario, side),
        tether=tether_of(scenario, side),
    )

"""The gateway's process and an emulated arm over TCP: who dies leaves no power behind."""

from __future__ import annotations

import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest

from shared import topics
from shared.bus import Subscription
from shared.cr5.packet import PacketReader
from shared.messages import ArmCommand, ArmStates
from stack.client import Client
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live

SCENARIO = str(Path(__file__).parents[3] / "scenarios" / "fixed-end.toml")
HOST = "127.0.0.53"
START_TIMEOUT = 60.0


class Process:
    """A process of the repository that is ended with the test."""

    def __init__(self, stack: ExitStack, module: str, *arguments: str) -> None:
        command = [sys.executable, "-m", module, "--scenario", SCENARIO, *arguments]
        self.process = subprocess.Popen(command)
        stack.callback(self.end, signal.SIGKILL)

    def end(self, number: signal.Signals) -> int:
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.wait(timeout=10.0)


class Drives:
    """Feedback of the arm on a connection of its own."""

    def __init__(self, stack: ExitStack) -> None:
        self._reader = PacketReader()
        self._enabled = False
        until(self._connect, START_TIMEOUT)
        stack.callback(self._socket.close)

    def _connect(self) -> bool:
        try:
            self._socket = socket.create_connection((HOST, 30004), timeout=1.0)
        except OSError:
            return False
        return True

    @property
    def enabled(self) -> bool:
        packet = self._reader.feed(self._socket.recv(65536))
        if packet is not None:
            self._enabled = bool(packet["enable_status"])
        return self._enabled


@pytest.fixture
def processes() -> Iterator[ExitStack]:
    with ExitStack() as stack:
        yield stack


def newest(states: Subscription) -> ArmStates:
    found: list[ArmStates] = []
    until(lambda: found.extend(item.message for _, item in states.take()) or found)
    return found[-1]


def test_arm_loses_its_power_after_a_killed_gateway_and_with_one_that_ends(
    processes: ExitStack,
) -> None:
    Process(processes, "services.cr5_emulator", "--host", HOST)
    cell = Cell(processes)
    gateway_arguments = ("--right-emulator", HOST, "--restarted", *cell.arguments)
    gateway = Process(processes, "services.robot_gateway", *gateway_arguments)
    bus = cell("person")
    client, states = Client(bus, "person"), bus.subscribe(topics.ARM_STATE)
    drives = Drives(processes)

    until(lambda: "unpowered" in condition(newest(states)), START_TIMEOUT)
    client.command_arms(ArmCommand.ARM)
    until(lambda: drives.enabled)
    first = newest(states).boot
    gateway.end(signal.SIGKILL)
    # Its guard outlives it.
    until(lambda: not drives.enabled)

    gateway = Process(processes, "services.robot_gateway", *gateway_arguments)
    until(lambda: (state := newest_or_none(states)) and state.boot != first, START_TIMEOUT)
    until(lambda: not drives.enabled)
    until(lambda: condition(newest(states)) == "disarmed, unpowered")

    client.command_arms(ArmCommand.ARM)
    until(lambda: drives.enabled)
    assert gateway.end(signal.SIGTERM) == 0
    until(lambda: not drives.enabled)


def newest_or_none(states: Subscription) -> ArmStates | None:
    items = states.take()
    return items[-1][1].message if items else None


def condition(state: ArmStates) -> str:
    powered = any(arm.powered for arm in state.arms)
    mode = ArmStates.Mode.Name(state.mode).lower()
    return f"{mode}, {'powered' if powered else 'unpowered'}"

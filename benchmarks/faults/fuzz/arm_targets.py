"""Ports of a CR5 under hostile bytes: the gateway's client, and the emulator."""

from __future__ import annotations

import random
import struct
import traceback
from dataclasses import replace

import numpy as np

from benchmarks.faults.fuzz.hostile_bytes import mutated
from benchmarks.faults.fuzz.message_targets import Totals
from lariat.scenario import load
from lariat.scenario.shipped import find
from lariat.trajectory import SECOND
from services.cr5_emulator.connection import Connection
from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.options import EmulatorOptions
from services.robot_gateway import service as gateway
from services.robot_gateway.drivers.cr5.link import ByteStream, StreamState
from shared.runtime.service import Inbox
from stack.simulation.emulated_arms import MemoryLink, emulated_links
from stack.simulation.simulated_time import START

SCENARIO = find("fixed-end")
"""Scenario of the gateway, with a CR5 at its right end."""
GATEWAY_PERIOD = SECOND // 125
"""Time between two steps of the gateway [ns]."""
MUTATION_PROBABILITIES = (0.3, 0.03)
"""Shares of the segments from the arm that are changed: with the larger one its link is lost again
and again, with the smaller one it is enabled."""
JOINT_TOLERANCE = 1e-6
"""Motion of a joint above which the arm counts as moved [rad]."""
DOUBLES = (np.nan, np.inf, -np.inf, 1e308, -1e6, 0.0, 361.0)
"""Values that are written over the numbers of a packet."""
ARGUMENTS = ("0", "1", "-1", "nan", "1e308", "9" * 30, "{1,2,3}", "", "joint={0,0,0,0,0,0}", '"x"')
"""Arguments of hostile commands."""
PORTS = (29999, 30003, 30004, 22000)
"""Ports to which hostile bytes are sent."""
STEPS_AFTER_COMMAND = 4
"""Periods of 8 ms that the emulator advances after a command."""


class ClientTarget:
    """Gateway whose arm sends changed replies and packets.

    A failure is an exception, or a joint of the arm that moves: no setpoints are sent.
    """

    def __init__(self) -> None:
        self._build()

    def _build(self) -> None:
        scenario = load(SCENARIO)
        links = emulated_links(scenario, START)
        self._links = {side: HostileLink(link) for side, link in links.items()}
        self._arms = [link.emulator.controller for link in links.values()]
        self._gateway = gateway.build(scenario, "robot_gateway-0", links=dict(self._links))
        self._now = START
        self._joints: list[np.ndarray] = []

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Step the gateway until so many segments have been changed."""
        rng = random.Random(seed)
        share = rng.choice(MUTATION_PROBABILITIES)
        self._attack(rng, share)
        target = totals.messages + count
        before = totals.messages
        while totals.messages < target:
            try:
                self._now += GATEWAY_PERIOD
                list(self._gateway.step(Inbox({}, {}), self._now))
            except Exception:
                totals.failures.append(f"cr5-client {seed}: {traceback.format_exc(limit=-4)}")
                totals.messages += 1
                self._build()
                self._attack(rng, share)
                before = totals.messages
            totals.steps += 1
            totals.messages = min(before + sum(k.changed for k in self._links.values()), target)
            self._judge(seed, totals)

    def close(self) -> None:
        """End the connections."""
        self._gateway.close()

    def _attack(self, rng: random.Random, share: float) -> None:
        for link in self._links.values():
            link.rng, link.share, link.changed = rng, share, 0

    def _judge(self, seed: str, totals: Totals) -> None:
        """Report an arm that has moved since it was placed at the start."""
        joints = [np.array(arm.joints) for arm in self._arms]
        if self._joints and any(
            not np.max(np.abs(a - b)) <= JOINT_TOLERANCE
            for a, b in zip(joints, self._joints, strict=True)
        ):
            totals.failures.append(f"cr5-client {seed}: the arm moved, {joints}")
            self._joints = joints
        self._joints = self._joints or joints


class HostileLink:
    """Link to an emulated arm that changes what the arm sends."""

    live = False
    """Whether the arm runs in real time."""

    def __init__(self, link: MemoryLink) -> None:
        self._link = link
        self.rng = random.Random(0)
        """Source of the choices."""
        self.share = 0.0
        """Share of the segments that are changed [-]."""
        self.changed = 0
        """Number of segments that have been changed."""

    def open(self, port: int) -> ByteStream:
        """Return a connection whose segments are changed."""
        return HostileStream(self._link.open(port), self)

    def advance(self, now: int) -> None:
        """Advance the arm to the time of a step [ns]."""
        self._link.advance(now)

    def guard(self, stream: ByteStream | None, commands: tuple[str, str], moving: bool) -> None:
        """Do nothing: the arm and the gateway are one process."""

    def close(self) -> None:
        """Do nothing: there is no guard."""


class HostileStream:
    """Connection to one port that changes what it receives."""

    def __init__(self, stream: ByteStream, link: HostileLink) -> None:
        self._stream, self._link = stream, link

    @property
    def state(self) -> StreamState:
        """Whether the connection is open."""
        return self._stream.state

    @property
    def reason(self) -> str:
        """Reason why it is closed."""
        return self._stream.reason

    def send(self, data: bytes) -> None:
        """Send bytes to the arm."""
        self._stream.send(data)

    def receive(self) -> bytes:
        """Return the bytes from the arm, some of them changed."""
        data, rng = self._stream.receive(), self._link.rng
        if not data or rng.random() >= self._link.share:
            return data
        self._link.changed += 1
        if len(data) % 1440 == 0 and rng.random() < 0.5:
            return _with_other_numbers(data, rng)
        return mutated(data, rng)

    def close(self) -> None:
        """Close the connection."""
        self._stream.close()

    def abort(self) -> None:
        """Close the connection at once."""
        self._stream.abort()


class EmulatorTarget:
    """Emulator whose clients send hostile commands and bytes; a failure is an exception."""

    def __init__(self) -> None:
        self._build("v3")

    def _build(self, firmware: str) -> None:
        options = replace(EmulatorOptions(), firmware="v4" if firmware == "v3" else "v3")
        self._emulator = Emulator(options)
        self._names = sorted(self._emulator.commands.table)
        self._connections: dict[int, Connection] = {}

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Send hostile commands to the emulator, and advance it."""
        rng = random.Random(seed)
        self._build(rng.choice(("v3", "v4")))
        for _ in range(count):
            content = self._command(rng)
            totals.messages += 1
            try:
                self._send(rng.choice(PORTS), content)
                self._emulator.advance_to(self._emulator.now + 0.008 * STEPS_AFTER_COMMAND)
                self._read()
                totals.accepted += 1
            except Exception:
                where = traceback.format_exc(limit=-4)
                totals.failures.append(f"cr5-emulator {seed}: {content[:80]!r}: {where}")
                self._build("v3")
            totals.steps += STEPS_AFTER_COMMAND

    def close(self) -> None:
        """Do nothing."""

    def _command(self, rng: random.Random) -> bytes:
        count = rng.randrange(8)
        arguments = [
            rng.choice(ARGUMENTS) if rng.random() < 0.5 else f"{rng.uniform(-400, 400):.3f}"
            for _ in range(count)
        ]
        text = f"{rng.choice(self._names)}({','.join(arguments)})".encode()
        return text if rng.random() < 0.6 else mutated(text, rng)

    def _send(self, port: int, content: bytes) -> None:
        connection = self._connections.get(port)
        if connection is None or connection.closed:
            connection = self._emulator.connect(port)
            if connection is None:
                return
            self._connections[port] = connection
        connection.feed(content)

    def _read(self) -> None:
        for connection in self._connections.values():
            while connection.take() is not None:
                pass


def _with_other_numbers(packet: bytes, rng: random.Random) -> bytes:
    """Return a feedback packet with some of its doubles replaced."""
    data = bytearray(packet)
    for _ in range(rng.randrange(1, 8)):
        at = 8 * rng.randrange(len(data) // 8)
        data[at : at + 8] = struct.pack("<d", rng.choice(DOUBLES))
    return bytes(data)

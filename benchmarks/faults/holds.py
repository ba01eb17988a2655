"""HOLD of a page while others attack, from press to confirmed: `lariat bench faults holds`."""

from __future__ import annotations

import asyncio
import json as encoder
import os
import signal
import subprocess
import sys
import time
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import aiohttp
import msgspec
import numpy as np
import zstandard

from benchmarks.child_processes import child_processes
from benchmarks.faults.attacks import STILL, NoControl, grip_positions
from benchmarks.live_stack import LiveStack
from benchmarks.speed.pages import CAMERA, PROTOCOL, admitted
from benchmarks.tables import PRINT_DEFAULTS, Flat, PrintOptions, Result
from dashboard.uploads import MAX_FILE_SIZE
from dashboard.web.browser_messages import FileTransferPart, FileTransferStartUpload
from lariat.configuration import ConfigurationError
from lariat.scenario.shipped import find
from stack.client import Client

DEFAULT_SCENARIO = Path("three-cylinders")
"""Scenario of the stack."""
PRESS_PERIOD = 0.05
"""Time between the answer to a hold and the next press [s]."""
ANSWER_TIMEOUT = 5.0
"""Longest wait for an answer to a hold [s]."""
LIMIT = 0.15
"""Time within which 99 % of all holds must be confirmed [s]."""
RETURN_LIMIT = 2.0
"""Time within which a hold must be confirmed that is pressed while the dashboard is dead [s]."""
WORST_FILES = (
    "a=[" + "1," * (MAX_FILE_SIZE // 2 - 8) + "]",
    "a=[" + "{b=1}," * (MAX_FILE_SIZE // 6 - 8) + "]",
    "a=[" + f"{'[' * 30}{']' * 30}," * (MAX_FILE_SIZE // 61 - 8) + "]",
    'a="""' + "x" * (MAX_FILE_SIZE - 16) + '"""',
    "[[a]]\n" * (MAX_FILE_SIZE // 6 - 8),
)
"""Files of the largest size that take the parser longest, in whole or in one call."""
UPLOADS = 10
"""Number of files at once."""
CROWD = """
import os, resource, socket, sys
port, count = map(int, sys.argv[1:])
resource.setrlimit(resource.RLIMIT_NOFILE, 2 * (resource.getrlimit(resource.RLIMIT_NOFILE)[1],))
if not os.geteuid():
    os.setgroups([]), os.setgid(65534), os.setuid(65534)
while True:
    crowd = []
    for k in range(count):
        crowd.append(socket.socket())
        crowd[-1].connect(("127.0.0.1", port))
        if k % 2:
            crowd[-1].send(b"GET / HTTP/1.1\\r\\nHost: ")
        print(1, flush=True)
"""
"""Program of another user that opens connections again and again, half of them with half a
request, and prints a 1 for each."""
CONNECTIONS = 5000
"""Number of connections of another user."""


class Page:
    """Page that was opened with the printed address."""

    def __init__(self, session: aiohttp.ClientSession, stack: LiveStack) -> None:
        self._session, self._address = session, stack.address
        self.port, self.hub_port = urlsplit(stack.address).port or 80, stack.port
        self.ros2_router = stack.ros2_router
        self.launcher = stack.pid
        self.buttons: list[str] = []
        """Buttons that take a file."""
        self.notes = 0
        """Number of notifications so far."""

    async def open(self) -> None:
        """Open the page, and read what it shows until the session ends.

        Raises:
            NoControl: It has no button that takes a file.
        """
        page, headers = await admitted(self._session, self._address)
        connect = self._session.ws_connect
        self._connect = partial(connect, f"{page}/cell", headers=headers)
        self._bar = await self._connect()
        self._viser = await connect(page, protocols=(PROTOCOL,), headers=headers, max_msg_size=0)
        await self.send(CAMERA)
        self._reading = asyncio.create_task(self._read())
        deadline = time.monotonic() + ANSWER_TIMEOUT
        while not self.buttons:
            if time.monotonic() > deadline:
                raise NoControl("the page shows no button that takes a file")
            await asyncio.sleep(PRESS_PERIOD)

    async def _read(self) -> None:
        async for frame in self._viser:
            size = int.from_bytes(frame.data[8:16], "little")
            content = zstandard.decompress(frame.data[16 : 16 + size])
            for message in msgspec.msgpack.decode(content)["messages"]:
                if message["type"] == "GuiUploadButtonMessage":
                    self.buttons.append(message["uuid"])
                self.notes += message["type"] == "NotificationShowMessage"

    async def send(self, message: msgspec.Struct) -> None:
        """Send what viser's side of a page sends."""
        await self._viser.send_bytes(msgspec.msgpack.encode(message))

    async def hold(self, number: int) -> tuple[float, bool]:
        """Press HOLD; return the time until its answer [s], and whether it is confirmed.

        A press that loses the connection is sent again over a new one, as the page does it.
        """
        begun = time.monotonic()
        while True:
            try:
                confirmed = await self._ask(number)
                return time.monotonic() - begun, confirmed
            except (aiohttp.ClientError, aiohttp.WSMessageTypeError):
                await asyncio.sleep(PRESS_PERIOD)
            with suppress(aiohttp.ClientError):
                self._bar = await self._connect()

    async def _ask(self, number: int) -> bool:
        await self._bar.send_str(encoder.dumps({"type": "hold", "number": number}))
        while True:
            answer = encoder.loads(await self._bar.receive_str(timeout=ANSWER_TIMEOUT))
            if answer.get("hold") == number:
                return answer["answer"]["confirmed"]
            await self._bar.send_str('{"type": "seen"}')


KILLED = "kill -9 of the dashboard"
"""Case in which one press waits for the next process."""
Count = Callable[[], int]
"""Number of attacks that have arrived."""


@asynccontextmanager
async def _none(page: Page) -> AsyncIterator[Count]:
    yield lambda: 1


@asynccontextmanager
async def _uploads(page: Page) -> AsyncIterator[Count]:
    """Upload the worst files at once, and again as soon as all have been refused."""
    before = page.notes

    async def upload() -> None:
        sent = 0
        while True:
            for k in range(UPLOADS):
                content = WORST_FILES[k % len(WORST_FILES)].encode()
                ids = {
                    "source_component_uuid": page.buttons[k % len(page.buttons)],
                    "transfer_uuid": f"{sent}-{k}",
                }
                more = {"mime_type": "", "part_count": 1, "size_bytes": len(content)}
                await page.send(FileTransferStartUpload(**ids, filename="worst.toml", **more))
                await page.send(FileTransferPart(**ids, part_index=0, content=content))
            sent += UPLOADS
            while page.notes - before < sent:
                await asyncio.sleep(PRESS_PERIOD)

    uploading = asyncio.create_task(upload())
    try:
        yield lambda: page.notes - before
    finally:
        uploading.cancel()


@asynccontextmanager
async def _program(*words: object) -> AsyncIterator[Count]:
    """Run a program of Python that prints a 1 for each attack that has arrived."""
    program = subprocess.Popen([sys.executable, *map(str, words)], stdout=subprocess.PIPE)
    assert program.stdout is not None
    os.set_blocking(program.stdout.fileno(), False)
    arrived = 0

    def count() -> int:
        nonlocal arrived
        assert program.stdout is not None
        arrived += sum(map(int, (program.stdout.read() or b"").split()))
        return arrived

    try:
        yield count
    finally:
        program.kill()
        program.wait()


def _crowd(port: int) -> AbstractAsyncContextManager[Count]:
    """Open connections as another user."""
    return _program("-S", "-c", CROWD, port, CONNECTIONS)


def _node(page: Page, attack: str) -> AbstractAsyncContextManager[Count]:
    """Attack as a node of ROS 2."""
    return _program("-m", "benchmarks.faults.hostile_node", page.ros2_router, attack)


@asynccontextmanager
async def _death(page: Page) -> AsyncIterator[Count]:
    """Kill the dashboard, which the launcher starts again."""
    (dashboard,) = (p for p, n in child_processes(page.launcher).items() if n == "dashboard")
    os.kill(dashboard, signal.SIGKILL)
    yield lambda: 1


CASES: dict[str, tuple[Callable[[Page], AbstractAsyncContextManager[Count]], int]] = {
    "idle": (_none, 1),
    "ten of the worst files at once": (_uploads, 1),
    "5,000 connections of another user": (lambda page: _crowd(page.port), CONNECTIONS),
    "5,000 to the bus": (lambda page: _crowd(page.hub_port), CONNECTIONS),
    "ROS 2: ten slow subscribers to all": (lambda page: _node(page, "subscribers"), 500),
    "ROS 2: garbage to all services": (lambda page: _node(page, "calls"), 5000),
    "ROS 2: queries for all": (lambda page: _node(page, "queries"), 5000),
    KILLED: (_death, 1),
}
"""Attacks during which HOLD is pressed, by name, and how many of them must arrive meanwhile."""
ARRIVAL_TIMEOUT = 180.0
"""Longest time until so many have arrived [s]."""


def run(
    cases: tuple[str, ...] = tuple(CASES),
    scenario: Path = DEFAULT_SCENARIO,
    seconds: float = 20.0,
    options: Flat[PrintOptions] = PRINT_DEFAULTS,
) -> int:
    """Press HOLD again and again on the page of a live stack while others attack it.

    Args:
        cases: Names of the cases, as in the first column.
        scenario: A scenario's TOML file, or the short name of a shipped one.
        seconds: Duration of each case, at least: it ends when its attacks have arrived [s].

    Returns:
        0 when every hold was confirmed, 99 % of each case within 150 ms, or each within 2 s of the
        dashboard's death, and no grip moved, 1 otherwise.
    """
    for name in cases:
        if name not in CASES:
            raise ConfigurationError(f"no case {name!r}; expected one of {', '.join(CASES)}")
    ros2 = any(case.startswith("ROS 2") for case in cases)
    with LiveStack(find(scenario), ros2=ros2) as stack, stack.connect() as client:
        results = asyncio.run(_press_all(stack, client, cases, seconds))
    conditions = f"{os.cpu_count()} cores, load {os.getloadavg()[0]:.1f}"
    options.publish(Result("holds", results, conditions))
    return 0 if results and all(each["ok"] for each in results) else 1


async def _press_all(
    stack: LiveStack, client: Client, cases: tuple[str, ...], seconds: float
) -> list[dict[str, Any]]:
    # One page, which has the controls: others may not upload.
    async with aiohttp.ClientSession() as session:
        page = Page(session, stack)
        await page.open()
        return [await _press(page, client, case, seconds) for case in cases]


async def _press(page: Page, client: Client, case: str, seconds: float) -> dict[str, Any]:
    """Press HOLD during an attack, at least until it has arrived.

    Good: all are confirmed, 99 % within `LIMIT`, or each within `RETURN_LIMIT` of the dashboard's
    death, and no grip has moved.
    """
    waits, confirmed, attacks = [], 0, 0
    places = grip_positions(client.newest_arm_state())
    attack, needed = CASES[case]
    async with attack(page) as count:
        end = time.monotonic() + seconds
        while time.monotonic() < end or attacks < needed:
            if time.monotonic() > end + ARRIVAL_TIMEOUT:
                raise NoControl(f"{case}: {attacks} of {needed} arrive")
            wait, answer = await page.hold(len(waits))
            waits.append(1e3 * wait)
            confirmed += answer
            attacks = count()
            await asyncio.sleep(PRESS_PERIOD)
    p50, p99 = np.percentile(waits, [50, 99])
    unconfirmed = len(waits) - confirmed
    moved = np.abs(grip_positions(client.newest_arm_state()) - places).max()
    in_time = max(waits) <= 1e3 * RETURN_LIMIT if case == KILLED else p99 <= 1e3 * LIMIT
    return {
        "case": case,
        "attacks": attacks,
        "holds": len(waits),
        "unconfirmed": unconfirmed,
        "p50_ms": round(p50, 1),
        "p99_ms": round(p99, 1),
        "longest_ms": round(max(waits), 1),
        "moved_mm": round(1e3 * moved, 2),
        "ok": not unconfirmed and bool(in_time and moved < STILL),
    }

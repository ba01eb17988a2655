"""Page under a hostile browser: frames of its WebSocket, and requests to its web server."""

from __future__ import annotations

import asyncio
import random
import re
import socket
import traceback
from collections.abc import Iterator
from urllib.parse import urlsplit

import aiohttp
import msgspec
import viser

from benchmarks.faults.fuzz.hostile_bytes import mutated
from benchmarks.faults.fuzz.message_targets import Totals
from dashboard.options import DashboardOptions
from dashboard.service import DashboardService, build
from lariat.scenario import Scenario
from lariat.trajectory import SECOND
from shared.runtime.service import Inbox
from stack.simulation.simulated_time import START

PROTOCOL = f"viser-v{viser.__version__}"
"""Protocol of viser's side of the page."""
IDENTIFIER = re.compile(rb"[0-9a-f]{8}(?:-[0-9a-f]{4}){3}-[0-9a-f]{12}")
"""Identifier of an element of the page, in what the server sends."""
VALUES = (None, True, -1, 1e308, 10**18, float("nan"), "x" * 300, "box", [], [1.0], ["a"] * 5, {})
"""Hostile values of elements."""
PATHS = ("/", "/login", "/x", "/hold", "/cell", "/../etc/passwd", "/%00", "/" + "a" * 9000)
"""Paths of hostile requests."""
NAMES = ("127.0.0.1", "localhost", "evil.example", "[::1", "127.0.0.1:99999", "a" * 300, "ß", "")
"""Hosts and origins of hostile requests."""
TIMEOUT = 20.0
"""Longest wait for an answer of the page [s]."""
REQUEST_SHARE = 16
"""Number of frames for each request."""


class PageTarget:
    """Dashboard that an admitted browser and strangers send what no page sends.

    A failure is an exception of a step, an answer of the kind 5xx, or a page that answers no more.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Start a dashboard on a free port of 127.0.0.1."""
        with socket.socket() as probe:
            probe.bind(("127.0.0.1", 0))
            port = probe.getsockname()[1]
        self._service: DashboardService = build(scenario, "p", DashboardOptions(port=port))
        self._now = START

    def run_batch(self, seed: str, count: int, totals: Totals) -> None:
        """Send hostile frames and requests, and step the dashboard."""
        rng = random.Random(seed)
        try:
            asyncio.run(self._attack(rng, count))
            for _ in range(3):
                self._now += SECOND // 30
                list(self._service.step(Inbox({}, {}), self._now))
                totals.steps += 1
        except Exception:
            totals.failures.append(f"page {seed}: {traceback.format_exc(limit=-4)}")
        totals.messages += count

    def close(self) -> None:
        """End the dashboard."""
        self._service.close()

    async def _attack(self, rng: random.Random, count: int) -> None:
        parts = urlsplit(self._service.address)
        origin = f"http://{parts.netloc}"
        timeout = aiohttp.ClientTimeout(total=TIMEOUT)
        async with aiohttp.ClientSession(timeout=timeout) as session:
            async with session.get(self._service.address) as answer:
                entrance = await answer.text()
                cookie = answer.headers["Set-Cookie"].partition(";")[0]
            page = origin + entrance.partition("url=")[2].partition('"')[0].rstrip("/")
            for _ in range(count // REQUEST_SHARE):
                await self._ask(session, origin, rng)
            frames = count - count // REQUEST_SHARE
            headers = {"Cookie": cookie, "Origin": origin}
            async with session.ws_connect(
                page, protocols=(PROTOCOL,), headers=headers, max_msg_size=0
            ) as browser:
                first = await browser.receive(TIMEOUT)
                names = [name.decode() for name in IDENTIFIER.findall(first.data or b"")]
                for frame in _frames(rng, names or ["x"], frames):
                    if isinstance(frame, str):
                        await browser.send_str(frame)
                    else:
                        await browser.send_bytes(frame)
            async with session.get(page + "/", headers=headers) as answer:
                if answer.status != 200:
                    raise RuntimeError(f"the page answers {answer.status}")

    async def _ask(self, session: aiohttp.ClientSession, origin: str, rng: random.Random) -> None:
        headers = {"Host": rng.choice(NAMES), "Origin": rng.choice((*NAMES, origin, "null"))}
        method, path = rng.choice(("GET", "POST", "PUT", "OPTIONS")), rng.choice(PATHS)
        try:
            async with session.request(
                method,
                origin + path,
                headers=headers,
                data=rng.randbytes(rng.choice((0, 99, 9999))),
            ) as answer:
                if answer.status >= 500:
                    raise RuntimeError(f"{method} {path} with {headers} answers {answer.status}")
        except (aiohttp.ClientError, ValueError):
            pass  # It is refused before it is read, or no such request can be written.


def _frames(rng: random.Random, names: list[str], count: int) -> Iterator[bytes | str]:
    """Yield random bytes, texts, and messages with wrong values or changed bytes."""
    kinds = (
        ("GuiUpdateMessage", lambda: {"uuid": rng.choice(names), "updates": _update(rng)}),
        ("TransformControlsUpdateMessage", lambda: _drag(rng)),
        ("SceneNodeClickMessage", lambda: _drag(rng)),
        ("FileTransferStartUpload", lambda: {"part_count": rng.choice(VALUES)}),
        ("ShareUrlRequest", dict),
    )
    for _ in range(count):
        name, fields = rng.choice(kinds)
        content = msgspec.msgpack.encode({"type": name, **fields()})
        match rng.randrange(5):
            case 0:
                yield rng.randbytes(rng.randrange(200))
            case 1:
                yield mutated(content, rng)
            case 2 if rng.random() < 0.2:
                yield "text"
            case _:
                yield content


def _update(rng: random.Random) -> dict[str, object]:
    return {rng.choice(("value", "value", "visible")): rng.choice(VALUES)}


def _drag(rng: random.Random) -> dict[str, object]:
    return {
        "name": rng.choice(("/edit/left", "/edit/obstacle", "/obstacles/low", "/", "x")),
        "wxyz": [rng.choice((0.0, 1.0, 1e9, float("nan"))) for _ in range(4)],
        "position": [rng.choice((0.0, -1e9, 1e9)) for _ in range(rng.choice((3, 3, 2)))],
        "owner": rng.choice(("", "x")),
    }

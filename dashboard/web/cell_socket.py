"""What the stop bar says to the cell and hears from it, beside viser and independent of it."""

from __future__ import annotations

import asyncio
import time
from concurrent.futures import Future
from typing import Annotated, Protocol

import msgspec
from aiohttp import WSMsgType, web
from msgspec import Meta

from dashboard.web.controls import Controls

HOLD_TIMEOUT = 1.0
"""Time after which a hold that the gateway has not confirmed is reported as such [s]."""
MAX_MESSAGE = 512
"""Largest message of a stop bar [bytes]."""
PING_PERIOD = 5.0
"""Time between two pings [s]."""
MAX_HOLDS = 16
"""Largest number of holds of a bar that wait for an answer at a time [-]; others go unanswered."""
MAX_BARS = 64
"""Largest number of stop bars that are connected at a time [-]."""


class Approach(msgspec.Struct, tag_field="type", tag="approach", frozen=True):
    """Sign of life of a person who holds the approach's button."""

    press: Annotated[int, Meta(ge=1, lt=1 << 53)]
    """Number of the press, which the browser chooses at random."""
    distance: Annotated[float, Meta(ge=0.0, le=100.0)]
    """Distance that the button names [m]."""
    angle: Annotated[float, Meta(ge=0.0, le=100.0)]
    """Angle that the button names [rad]."""


class Release(msgspec.Struct, tag_field="type", tag="release", frozen=True):
    """End of a press."""

    press: int
    """Number of the press."""


class Hold(msgspec.Struct, tag_field="type", tag="hold", frozen=True):
    """Press of HOLD."""

    number: Annotated[int, Meta(ge=0, lt=1 << 53)]
    """Number by which the answer names it."""


class Seen(msgspec.Struct, tag_field="type", tag="seen", frozen=True):
    """Receipt of a status, after which the next one is sent: none waits for a slow browser."""


class Ask(msgspec.Struct, tag_field="type", tag="ask", frozen=True):
    """Wish for the controls."""


class Answer(msgspec.Struct, tag_field="type", tag="answer", frozen=True):
    """Answer of the page that has the controls to one that asks for them."""

    give: bool
    """Whether it gives them."""


class HoldAnswer(msgspec.Struct, frozen=True):
    """Answer to a hold."""

    confirmed: bool
    """Whether the gateway has said that it stops or stands."""
    text: str
    """State of the arms, or why nothing is confirmed."""


class Cell(Protocol):
    """Cell whose arms the stop bar holds; its methods are called in the web server's thread."""

    def hold(self) -> Future[HoldAnswer]:
        """Stop the arms; the future is completed when the gateway has confirmed it."""
        ...

    def approach(self, sign: Approach) -> None:
        """Take a sign of life of a person who holds the approach's button."""
        ...

    def release(self, press: int) -> None:
        """End a press."""
        ...


class CellSocket:
    """Connections of all stop bars."""

    def __init__(self, cell: Cell, controls: Controls) -> None:
        self._cell, self._controls = cell, controls
        self._status = ""
        self._news: set[asyncio.Event] = set()
        self._decoder = msgspec.json.Decoder(Hold | Approach | Release | Seen | Ask | Answer)

    def show(self, status: str) -> None:
        """Send a status, a JSON object, to every stop bar; called in the web server's thread."""
        self._status = status
        self._controls.advance(time.monotonic())
        self._announce()

    async def hold(self, request: web.Request) -> web.Response:
        """Answer a request to hold, of a page whose socket is not open."""
        body = msgspec.json.encode(await self._hold())
        return web.Response(body=body, content_type="application/json")

    async def _hold(self) -> HoldAnswer:
        """Hold, and return the gateway's answer, or that there is none after `HOLD_TIMEOUT`."""
        future = asyncio.wrap_future(self._cell.hold())
        try:
            return await asyncio.wait_for(future, HOLD_TIMEOUT)
        except TimeoutError:
            return HoldAnswer(False, "the robot gateway has not confirmed it")

    async def _answer_hold(self, socket: web.WebSocketResponse, number: int) -> None:
        answer = {"hold": number, "answer": await self._hold()}
        await socket.send_str(msgspec.json.encode(answer).decode())

    async def serve(self, request: web.Request) -> web.StreamResponse:
        """Send the status and take what the page's bar says, until the browser leaves."""
        if len(self._news) >= MAX_BARS:
            raise web.HTTPServiceUnavailable(text=f"{MAX_BARS} pages are open, no more can be")
        socket = web.WebSocketResponse(
            max_msg_size=MAX_MESSAGE, heartbeat=PING_PERIOD, compress=False
        )
        await socket.prepare(request)
        page = request.match_info["page"]
        news, seen = asyncio.Event(), asyncio.Event()
        self._news.add(news)
        self._controls.enter(page, time.monotonic())
        sender = asyncio.create_task(self._send(socket, news, seen, page))
        press: int | None = None
        holds: set[asyncio.Task[None]] = set()
        try:
            async for message in socket:
                if message.type is not WSMsgType.TEXT:
                    break
                try:
                    said = self._decoder.decode(message.data)
                except (msgspec.DecodeError, UnicodeError):
                    break
                match said:
                    case Hold():
                        if len(holds) < MAX_HOLDS:
                            task = asyncio.create_task(self._answer_hold(socket, said.number))
                            holds.add(task)
                            task.add_done_callback(holds.discard)
                    case Seen():
                        seen.set()
                    case Ask():
                        self._controls.ask(page, time.monotonic())
                        self._announce()
                    case Answer():
                        self._controls.answer(page, said.give)
                        self._announce()
                    case Approach():
                        if self._controls.holds(page):
                            press = said.press
                            self._cell.approach(said)
                    case Release():
                        self._cell.release(said.press)
        finally:
            if press is not None:
                self._cell.release(press)
            self._news.discard(news)
            self._controls.leave(page, time.monotonic())
            sender.cancel()
            await asyncio.gather(sender, *holds, return_exceptions=True)
        await socket.close()
        return socket

    def _announce(self) -> None:
        for event in self._news:
            event.set()

    async def _send(
        self, socket: web.WebSocketResponse, news: asyncio.Event, seen: asyncio.Event, page: str
    ) -> None:
        """Send the newest status whenever there is news and the one before has been seen."""
        while True:
            if self._status:
                controls = {
                    "role": self._controls.role(page),
                    "asks": self._controls.asks(page),
                    "asked": self._controls.is_asked_for,
                }
                message = {"cell": msgspec.Raw(self._status.encode()), "controls": controls}
                seen.clear()
                await socket.send_str(msgspec.json.encode(message).decode())
                await seen.wait()
            await news.wait()
            news.clear()

"""WebSocket between a browser and viser, with bounds on what the browser sends."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable
from pathlib import Path

import aiohttp
from aiohttp import WSCloseCode, WSMsgType, web

from dashboard.web import browser_messages
from dashboard.web.browser_messages import (
    FileTransferPart,
    FileTransferStartUpload,
    ViewerCameraMessage,
)
from dashboard.web.controls import Controls

log = logging.getLogger(__name__)

MAX_PAGES = 32
"""Largest number of pages that are open at a time [-]."""
MAX_RATE = 1000
"""Largest number of messages of a page in a second [-]; a drag sends some for each move."""
MAX_UPLOADED = 16 << 20
"""Largest amount that a page uploads before its connection is closed [bytes]."""
UPLOAD_OVERHEAD = 2048
"""Amount that a message of an upload counts for beside its size [bytes]."""
PING_PERIOD = 10.0
"""Time between two pings [s]; a browser that does not answer is disconnected."""


class Relay:
    """Relay of all pages to one viser server."""

    def __init__(self, controls: Controls | None = None) -> None:
        self.viser_socket: Path | None = None
        """Unix socket of the server; None before it listens."""
        self._controls = controls
        self._open: list[str] = []
        """Pages that are connected."""

    def has_room(self, page: str) -> bool:
        """Whether a page, new or loaded again, will be served."""
        return page in self._open or len(self._open) < MAX_PAGES

    async def serve(self, request: web.Request) -> web.StreamResponse:
        """Relay messages until one side closes the connection."""
        if len(self._open) >= MAX_PAGES:
            raise web.HTTPServiceUnavailable(text=f"{MAX_PAGES} pages are open, no more can be")
        if self.viser_socket is None:
            raise web.HTTPServiceUnavailable(text="the page is being built; try again")
        page = request.match_info["page"]
        self._open.append(page)
        if self._controls:
            self._controls.enter(page, time.monotonic())
        try:
            connector = aiohttp.UnixConnector(str(self.viser_socket))
            async with aiohttp.ClientSession(connector=connector) as session:
                return await self._relay(request, session, page)
        finally:
            self._open.remove(page)
            if self._controls:
                self._controls.leave(page, time.monotonic())

    async def _relay(
        self, request: web.Request, session: aiohttp.ClientSession, page: str
    ) -> web.WebSocketResponse:
        controls = self._controls
        offered = request.headers.get("Sec-WebSocket-Protocol", "").split(",")
        protocols = [p.strip() for p in offered if p.strip()][:1]
        browser = web.WebSocketResponse(
            protocols=protocols,
            max_msg_size=browser_messages.MAX_MESSAGE,
            heartbeat=PING_PERIOD,
            compress=False,
        )
        # viser judges the version of the browser's side, which is its protocol.
        async with session.ws_connect(
            "http://viser/", protocols=protocols, max_msg_size=0, compress=0
        ) as server:
            await browser.prepare(request)
            ways = [
                asyncio.create_task(
                    _to_server(browser, server, lambda: controls is None or controls.holds(page))
                ),
                asyncio.create_task(_to_browser(server, browser)),
            ]
            try:
                await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            finally:
                for way in ways:
                    way.cancel()
                await asyncio.gather(*ways, return_exceptions=True)
            await browser.close(code=server.close_code or WSCloseCode.GOING_AWAY)
        return browser


async def _to_browser(
    server: aiohttp.ClientWebSocketResponse, browser: web.WebSocketResponse
) -> None:
    async for message in server:
        if message.type is WSMsgType.BINARY:
            await browser.send_bytes(message.data)


async def _to_server(
    browser: web.WebSocketResponse,
    server: aiohttp.ClientWebSocketResponse,
    may_act: Callable[[], bool],
) -> None:
    uploaded = refused = count = 0
    second = time.monotonic()
    async for message in browser:
        now = time.monotonic()
        if now - second >= 1.0:
            second, count = now, 0
        count += 1
        if count > MAX_RATE:
            log.warning("a page sent more than %d messages in a second: disconnected", MAX_RATE)
            await browser.close(code=WSCloseCode.POLICY_VIOLATION, message=b"too many messages")
            return
        try:
            if message.type is not WSMsgType.BINARY:
                raise ValueError(f"{message.type.name} instead of a binary message")
            decoded = browser_messages.decode(message.data)
        except ValueError as error:
            refused += 1
            if refused == 1:
                log.warning("a page sent a message that is refused: %s", str(error)[:200])
            continue
        if isinstance(decoded, FileTransferStartUpload | FileTransferPart):
            uploaded += len(message.data) + UPLOAD_OVERHEAD
            if uploaded > MAX_UPLOADED:
                await browser.close(code=WSCloseCode.MESSAGE_TOO_BIG, message=b"too many uploads")
                return
        # A page without the controls only looks around.
        if may_act() or isinstance(decoded, ViewerCameraMessage):
            await server.send_bytes(message.data)

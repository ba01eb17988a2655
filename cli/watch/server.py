"""Server of a cell's messages to viewers on this machine."""

from __future__ import annotations

import asyncio
import hmac
import ipaddress
import logging
import secrets
from collections import deque
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from http import HTTPStatus
from typing import Any
from urllib.parse import parse_qs, urlsplit

from websockets.asyncio.server import Server, ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from cli.watch.protocol import (
    SUBPROTOCOLS,
    Subscriptions,
    advertisement,
    message_data,
    server_info,
)
from dashboard.web.connections import Strangers, allow_many_descriptors
from shared import topics
from shared.bus.message_check import RawMessage
from shared.topics import Topic

HOST = "127.0.0.1"
"""Address that the server listens on."""
MAX_REQUEST_SIZE = 2**16
"""Largest frame of a viewer [bytes]."""
MAX_QUEUE = 256
"""Most frames that wait for a slow viewer; the oldest are dropped."""
MAX_VIEWERS = 8
"""Most viewers at the same time."""
_log = logging.getLogger("cli.watch.websockets")
# Otherwise whoever probes the port fills the terminal with tracebacks.
_log.setLevel(logging.CRITICAL)


@dataclass(eq=False)
class _Viewer:
    subscriptions: Subscriptions = field(default_factory=Subscriptions)
    frames: deque[str | bytes] = field(default_factory=lambda: deque(maxlen=MAX_QUEUE))
    arrived: asyncio.Event = field(default_factory=asyncio.Event)

    def put(self, frame: str | bytes) -> None:
        self.frames.append(frame)
        self.arrived.set()


class _Connection(ServerConnection):
    """Connection of a viewer, a stranger's until it has shown the token."""

    def __init__(self, strangers: Strangers, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self._strangers = strangers

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._strangers.enter(self, transport)

    def connection_lost(self, exc: Exception | None) -> None:
        self._strangers.leave(self)
        super().connection_lost(exc)


class LiveServer:
    """Server that passes messages of the bus to the viewers that subscribe to their topics."""

    def __init__(self, cell: str, token: str) -> None:
        self._cell = cell
        self._token = token
        self._session = secrets.token_hex(8)
        self._channels: dict[int, Topic] = {}
        self._numbers: dict[str, int] = {}
        self._viewers: set[_Viewer] = set()
        self._strangers = Strangers()

    @asynccontextmanager
    async def listening(self, port: int) -> AsyncIterator[str]:
        """Serve on a port while the context lasts; the value is the address with the token."""
        allow_many_descriptors()
        connection: Any = partial(_Connection, self._strangers)
        async with serve(
            self._attend,
            HOST,
            port,
            subprotocols=[Subprotocol(name) for name in SUBPROTOCOLS],
            process_request=self._admit,
            max_size=MAX_REQUEST_SIZE,
            compression=None,
            logger=_log,
            create_connection=connection,
        ) as server:
            yield f"ws://{HOST}:{_port(server)}/?token={self._token}"

    def publish(self, message: RawMessage) -> None:
        """Pass a message on, and announce its topic if it is the first of it."""
        number = self._numbers.get(message.key)
        if number is None:
            number = self._numbers[message.key] = len(self._numbers) + 1
            self._channels[number] = topics.find(message.key)
            for viewer in self._viewers:
                viewer.put(advertisement({number: self._channels[number]}))
        for viewer in self._viewers:
            for subscription in viewer.subscriptions.of_channel(number):
                viewer.put(message_data(subscription, message.received, message.payload))

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        """Refuse whoever lacks the token, or names this machine otherwise than by its loopback."""
        # A foreign site's name may lead here: DNS rebinding.
        if not all(map(_is_loopback, request.headers.get_all("Host"))):
            return connection.respond(HTTPStatus.FORBIDDEN, "use the printed address\n")
        token = parse_qs(urlsplit(request.path).query).get("token", [""])[0]
        if not hmac.compare_digest(token.encode(), self._token.encode()):
            return connection.respond(HTTPStatus.UNAUTHORIZED, "the token is missing or wrong\n")
        if len(self._viewers) >= MAX_VIEWERS:
            return connection.respond(HTTPStatus.SERVICE_UNAVAILABLE, "too many viewers\n")
        return None

    async def _attend(self, connection: ServerConnection) -> None:
        self._strangers.leave(connection)
        viewer = _Viewer()
        viewer.put(server_info(f"lariat {self._cell}", self._session))
        viewer.put(advertisement(self._channels))
        self._viewers.add(viewer)
        sending = asyncio.create_task(_send(connection, viewer))
        try:
            async for frame in connection:
                if answer := viewer.subscriptions.take(frame):
                    viewer.put(answer)
        except ConnectionClosed:
            pass
        finally:
            self._viewers.discard(viewer)
            sending.cancel()


async def _send(connection: ServerConnection, viewer: _Viewer) -> None:
    with suppress(ConnectionClosed):
        while True:
            await viewer.arrived.wait()
            viewer.arrived.clear()
            while viewer.frames:
                await connection.send(viewer.frames.popleft())


def _port(server: Server) -> int:
    (socket, *_) = server.sockets
    return socket.getsockname()[1]


def _is_loopback(host: str) -> bool:
    name = urlsplit(f"//{host}").hostname or ""
    try:
        return ipaddress.ip_address(name).is_loopback
    except ValueError:
        return name == "localhost"

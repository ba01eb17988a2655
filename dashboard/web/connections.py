"""Connections of browsers, and bounds on those of whom nobody knows.

Every user of the machine may connect. A connection is a stranger's until one of its requests has
shown the page's cookie, or the token of `lariat watch`; it ends after `STRANGER_TIME`, whatever it
has sent by then.
"""

from __future__ import annotations

import asyncio
import resource
from collections import Counter
from typing import Any, NamedTuple

from aiohttp import web

from shared.door import Door

MAX_STRANGERS = 128
"""Largest number of connections of strangers at a time [-]."""
STRANGER_TIME = 10.0
"""Longest life of a stranger's connection [s], for headers, body and a password's judgement."""


class _Stranger(NamedTuple):
    address: str
    transport: asyncio.BaseTransport
    timer: asyncio.TimerHandle


class Strangers:
    """Connections that have shown no secret yet, oldest first.

    Above `MAX_STRANGERS`, the oldest one of the address that has the most is closed, so that who
    opens many closes their own.
    """

    def __init__(self) -> None:
        self._strangers: dict[asyncio.BaseProtocol, _Stranger] = {}

    def __len__(self) -> int:
        return len(self._strangers)

    def enter(self, connection: asyncio.BaseProtocol, transport: asyncio.BaseTransport) -> None:
        """Add a connection, and close one if there are too many."""
        timer = asyncio.get_running_loop().call_later(STRANGER_TIME, self._end, connection)
        address = (transport.get_extra_info("peername") or ("",))[0]
        self._strangers[connection] = _Stranger(address, transport, timer)
        if len(self._strangers) > MAX_STRANGERS:
            (most, _), *_ = Counter(each.address for each in self._strangers.values()).most_common(
                1
            )
            self._end(next(c for c, each in self._strangers.items() if each.address == most))

    def leave(self, connection: asyncio.BaseProtocol) -> None:
        """Remove a connection that was admitted, or is closed."""
        if stranger := self._strangers.pop(connection, None):
            stranger.timer.cancel()

    def _end(self, connection: asyncio.BaseProtocol) -> None:
        transport = self._strangers[connection].transport
        self.leave(connection)
        if isinstance(transport, asyncio.Transport):
            transport.abort()


class Connection(web.RequestHandler):
    """Connection of a browser, a stranger's at first."""

    __slots__ = ("_door", "_strangers")

    def __init__(
        self, server: web.Server, loop: asyncio.AbstractEventLoop, strangers: Strangers, door: Door
    ) -> None:
        super().__init__(server, loop=loop, access_log=None)
        self._strangers, self._door = strangers, door

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Count the connection among those of strangers."""
        super().connection_made(transport)
        self._strangers.enter(self, transport)

    def connection_lost(self, exc: BaseException | None) -> None:
        """Forget the connection."""
        self._strangers.leave(self)
        super().connection_lost(exc)

    def log_exception(self, *args: Any, exc_info: Any = None, **options: Any) -> None:
        """Log a request that failed, folded: strangers can repeat it."""
        fault = exc_info if isinstance(exc_info, Exception) else None
        self._door.refuse("a browser's request", str(fault), fault)

    def admit(self) -> None:
        """Bound the connection no longer: a request has shown the cookie."""
        self._strangers.leave(self)


def allow_many_descriptors() -> None:
    """Raise this process' limit of descriptors to the hard one: each connection takes one."""
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))

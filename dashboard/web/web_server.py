"""Web server in front of viser, in a thread of its own."""

from __future__ import annotations

import asyncio
import secrets
import threading
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any
from urllib.parse import quote

from aiohttp import web

from dashboard.markup import escaped
from dashboard.options import DashboardOptions
from dashboard.web import html
from dashboard.web.access import COOKIE, Access, Address, parse_address
from dashboard.web.cell_socket import Cell, CellSocket
from dashboard.web.connections import Connection, Strangers, allow_many_descriptors
from dashboard.web.controls import Controls
from dashboard.web.relay import MAX_PAGES, Relay
from dashboard.web.secret_files import load_password, load_token
from lariat.configuration import ConfigurationError
from shared.door import Door

MAX_FORM = 4096
"""Largest body of a request [bytes]."""
WRONG_PASSWORD_DELAY = 1.0
"""Time that a wrong password takes; passwords are judged one at a time [s]."""
MAX_LOGINS = 8
"""Largest number of passwords that wait to be judged [-]."""
SHUTDOWN_TIMEOUT = 0.5
"""Time that open connections get to end [s]."""

NONCE_BYTES = 16
"""Random bytes of the word that the page's own scripts know."""
HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "X-Frame-Options": "DENY",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Cross-Origin-Resource-Policy": "same-origin",
    # Scripts are this server's, and those of viser's page that know the nonce. The page speaks to
    # this server alone, has no frames, and no site frames it.
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self' 'nonce-{nonce}' 'wasm-unsafe-eval'; "
        "worker-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; font-src 'self' data:; "
        "img-src 'self' data: blob:; media-src 'self' data: blob:; "
        "connect-src 'self' data: blob:; form-action 'self'; base-uri 'none'; "
        "frame-ancestors 'none'"
    ),
}
"""Headers of every answer; the nonce is new with every start."""

MAX_PORT = 65535
"""Largest TCP port."""

ADDRESS: web.RequestKey[Address] = web.RequestKey("address", Address)
"""Address under which a request reached the page."""

Handler = Callable[[web.Request], Awaitable[web.StreamResponse]]


class WebServer:
    """Server that admits browsers to the page of one viser server."""

    def __init__(
        self,
        options: DashboardOptions,
        title: str,
        cell: Cell | None = None,
    ) -> None:
        if not 0 <= options.port <= MAX_PORT:
            raise ConfigurationError(f"port {options.port} does not exist; give 0…{MAX_PORT}")
        addresses = _addresses(options)
        password = load_password(options.password_file) if options.password_file else ""
        token = load_token(options.token_file)
        self._access = Access(addresses, token, password)
        first = addresses[0] if addresses else parse_address(f"http://127.0.0.1:{options.port}")
        self.address = f"{first}/?token={token}" if first.is_loopback else f"{first}/"
        """Address that a person opens; on a loopback name it holds the token."""
        self._title = title
        self._nonce = secrets.token_urlsafe(NONCE_BYTES)
        self._headers = {
            name: text.replace("{nonce}", self._nonce) for name, text in HEADERS.items()
        }
        controls = Controls() if cell else None
        self._cell_socket = CellSocket(cell, controls) if cell and controls else None
        self._relay = Relay(controls)
        self._door = Door()
        self._strangers = Strangers()
        self._judging = asyncio.Lock()
        self._waiting = 0
        allow_many_descriptors()
        self._loop = asyncio.new_event_loop()
        self._loop.set_exception_handler(self._take_fault)
        self._runner = web.AppRunner(self._application(), shutdown_timeout=SHUTDOWN_TIMEOUT)
        try:
            self._loop.run_until_complete(self._listen(options.host, options.port))
        except OSError as error:
            self._loop.run_until_complete(self._runner.cleanup())
            self._loop.close()
            raise ConfigurationError(
                f"port {options.port} of {options.host} cannot be opened, it may be taken "
                f"({error.strerror}); stop what uses it or choose another with --port"
            ) from None
        self._thread = threading.Thread(
            target=self._loop.run_forever, name="web server", daemon=True
        )
        self._thread.start()

    def open_page(self, viser_socket: Path) -> None:
        """Serve the page of the viser server that listens on a Unix socket from now on."""
        self._relay.viser_socket = viser_socket

    def show(self, status: str) -> None:
        """Send a status, a JSON object, to the stop bar of every page; from any thread."""
        if self._cell_socket is not None:
            self._loop.call_soon_threadsafe(self._cell_socket.show, status)

    def close(self) -> None:
        """Disconnect everybody and stop."""
        stopped = asyncio.run_coroutine_threadsafe(self._stop(), self._loop)
        stopped.result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _listen(self, host: str, port: int) -> None:
        await self._runner.setup()
        server = self._runner.server
        assert server is not None
        self._listener = await self._loop.create_server(
            lambda: Connection(server, self._loop, self._strangers, self._door), host, port
        )

    async def _stop(self) -> None:
        self._listener.close()
        await self._runner.cleanup()
        # A handler that waits for a browser's last word would be destroyed with the loop.
        tasks = asyncio.all_tasks() - {asyncio.current_task()}
        for task in tasks:
            task.cancel()
        if tasks:
            await asyncio.wait(tasks, timeout=SHUTDOWN_TIMEOUT)

    def _take_fault(self, loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        """Log what went wrong at a connection, folded: strangers can repeat it."""
        error = context.get("exception")
        fault = error if isinstance(error, Exception) else None
        self._door.refuse("a connection", str(context["message"]), fault)

    def _application(self) -> web.Application:
        app = web.Application(middlewares=[self._guard], client_max_size=MAX_FORM)
        # Every window has an address of its own, by which it is known through a reload.
        page = f"/{self._access.path}/{{page:[A-Za-z0-9_-]{{1,32}}}}"
        app.router.add_get("/", self._enter)
        app.router.add_post("/login", self._log_in)
        # viser's side of the page takes its own address, without the slash, for its WebSocket.
        app.router.add_get(page, self._relay.serve)
        app.router.add_get(page + "/", self._show_page)
        parts = html.PARTS
        if self._cell_socket is not None:
            app.router.add_post(page + "/hold", self._cell_socket.hold)
            app.router.add_get(page + "/cell", self._cell_socket.serve)
            parts += html.CELL_PARTS
        for file in parts:
            app.router.add_get(f"{page}/{file}", _file(html.BROWSER / file))
        return app

    @web.middleware
    async def _guard(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        try:
            self._judge(request)
            answer = await handler(request)
        except (web.HTTPException, ValueError, LookupError) as error:
            if not isinstance(error, web.HTTPException):
                # A form that is none, an unknown character set.
                error = web.HTTPBadRequest(text=str(error))
            answer = web.Response(
                status=error.status,
                text=error.text if error.content_type == "text/html" else None,
                content_type="text/html",
            )
            if error.content_type != "text/html":
                answer.text = html.refusal(error.reason, escaped(error.text or ""))
        if not answer.prepared:
            answer.headers.update(self._headers)
        return answer

    def _judge(self, request: web.Request) -> None:
        """Refuse foreign names, foreign origins and those who were not admitted."""
        host = request.headers.get("Host", "")
        address = self._access.address_of(host)
        if address is None:
            raise _refusal(
                web.HTTPMisdirectedRequest,
                "Unknown address",
                "The page answers only under addresses that it was given. Name this one with "
                "<code>--address</code>.",
            )
        request[ADDRESS] = address
        upgrade = "upgrade" in request.headers.get("Connection", "").lower()
        origin = request.headers.get("Origin")
        acts = upgrade or request.method != "GET"
        if (acts or origin is not None) and not self._access.is_own_origin(address, origin):
            raise _refusal(
                web.HTTPForbidden, "Another site", "Only the page itself may ask for this."
            )
        if request.path not in ("/", "/login"):
            path = request.path.split("/")[1]
            path_admitted = self._access.admits_path(path)
            cookie = request.cookies.get(COOKIE, "")
            if not (self._access.admits_cookie(address, cookie) and path_admitted):
                raise self._closed(address)
            if isinstance(request.protocol, Connection):
                request.protocol.admit()
            # The page's own address, without the slash, and its cell are WebSockets.
            below = request.path.split("/")[3:]
            if upgrade != (below in ([], ["cell"])):
                raise _refusal(web.HTTPNotFound, "Nothing here", "")

    def _closed(self, address: Address) -> web.HTTPException:
        if not address.is_loopback:
            return _refusal(web.HTTPForbidden, "Closed", '<a href="/">Enter the password</a>.')
        return _refusal(
            web.HTTPForbidden,
            "Closed",
            "Open the address with <code>?token=</code> that the dashboard printed at its start: "
            "<code>lariat up</code> prints it in its last line, containers in "
            "<code>docker compose logs dashboard</code>. Every start has its own.",
        )

    async def _enter(self, request: web.Request) -> web.StreamResponse:
        address = request[ADDRESS]
        if not address.is_loopback:
            return web.Response(text=html.login(), content_type="text/html")
        if not self._access.admits_token(address, request.query.get("token", "")):
            raise self._closed(address)
        return self._admit(address)

    async def _log_in(self, request: web.Request) -> web.StreamResponse:
        address = request[ADDRESS]
        form = await request.post()
        # Many may have sent their forms meanwhile, or none of it.
        if self._waiting >= MAX_LOGINS:
            raise _refusal(web.HTTPTooManyRequests, "Too many attempts", "Try again in a minute.")
        self._waiting += 1
        try:
            async with self._judging:
                if self._access.admits_password(address, str(form.get("password", ""))):
                    return self._admit(address)
                self._door.refuse(f"a password at {address}", "it is wrong")
                await asyncio.sleep(WRONG_PASSWORD_DELAY)
        finally:
            self._waiting -= 1
        return web.Response(
            status=403, text=html.login("Not the password."), content_type="text/html"
        )

    def _admit(self, address: Address) -> web.Response:
        path = f"/{quote(self._access.path)}"
        page = f"{path}/{secrets.token_urlsafe(9)}/"
        answer = web.Response(text=html.entrance(page), content_type="text/html")
        answer.set_cookie(
            COOKIE,
            self._access.cookie(address),
            path=path,
            httponly=True,
            samesite="Strict",
            secure=address.scheme == "https",
        )
        return answer

    async def _show_page(self, request: web.Request) -> web.StreamResponse:
        if self._relay.viser_socket is None:
            raise _refusal(web.HTTPServiceUnavailable, "The page is being built", "Try again.")
        if not self._relay.has_room(request.match_info["page"]):
            words = (
                f"{MAX_PAGES} pages are open, no more can be. Close one, then load this one again."
            )
            raise _refusal(web.HTTPServiceUnavailable, "Too many pages", words)
        text = html.page(self._title, self._cell_socket is not None, self._nonce)
        return web.Response(text=text, content_type="text/html")


def _addresses(options: DashboardOptions) -> list[Address]:
    """Return the named addresses."""
    try:
        addresses = [parse_address(text) for text in options.address]
    except ValueError as error:
        raise ConfigurationError(f"--address {error}") from None
    for address in addresses:
        if address.is_loopback:
            continue
        if address.scheme != "https":
            raise ConfigurationError(
                f"--address {address}: others on the network could read the password; put a TLS "
                f"proxy before the page and name https://{address.name}, or use ssh -L"
            )
        if options.password_file is None:
            raise ConfigurationError(f"--address {address} needs --password-file FILE")
    return addresses


def _file(path: Path) -> Handler:
    async def send(request: web.Request) -> web.StreamResponse:
        return web.FileResponse(path)

    return send


def _refusal(kind: type[web.HTTPException], title: str, text: str) -> web.HTTPException:
    return kind(text=html.refusal(title, text), content_type="text/html")

"""Client of a web server, which sends whatever a browser, or an attacker, would send."""

from __future__ import annotations

import http.client
from collections.abc import Mapping
from typing import NamedTuple
from urllib.parse import urlsplit

import viser
from websockets.sync.client import ClientConnection, connect
from websockets.typing import Origin, Subprotocol

PROTOCOL = Subprotocol(f"viser-v{viser.__version__}")
"""Protocol of viser's side of the page."""


class Answer(NamedTuple):
    """Answer of the web server."""

    status: int
    headers: Mapping[str, str]
    text: str


class Visitor:
    """Somebody who knows the address that was printed."""

    def __init__(self, address: str) -> None:
        parts = urlsplit(address)
        self.netloc, self.query = parts.netloc, parts.query
        self._port = parts.port
        self.cookie = ""
        self.page = ""

    def ask(self, method: str, path: str, body: str = "", **headers: str) -> Answer:
        """Send a request; `headers` replace those of a browser, an empty one is left out."""
        sent = {"Host": self.netloc, "Cookie": self.cookie}
        if method == "POST":
            sent["Origin"] = f"http://{self.netloc}"
            sent["Content-Type"] = "application/x-www-form-urlencoded"
        sent |= headers
        connection = http.client.HTTPConnection("127.0.0.1", self._port, timeout=10.0)
        try:
            connection.request(method, path, body, {k: v for k, v in sent.items() if v})
            answer = connection.getresponse()
            return Answer(answer.status, dict(answer.getheaders()), answer.read().decode())
        finally:
            connection.close()

    def enter(self, answer: Answer | None = None) -> Visitor:
        """Open the printed address, or take an answer that admits; keep cookie and path."""
        answer = answer or self.ask("GET", f"/?{self.query}")
        assert answer.status == 200, answer.text
        self.cookie = answer.headers["Set-Cookie"].partition(";")[0]
        self.page = answer.text.partition("url=")[2].partition('"')[0]
        return self

    def open_socket(self, path: str = "", origin: str = "", **headers: str) -> ClientConnection:
        """Open the page's WebSocket to viser, or another one below the page."""
        return connect(
            f"ws://{self.netloc}{self.page.rstrip('/')}{path}",
            origin=Origin(origin or f"http://{self.netloc}"),
            subprotocols=None if path else [PROTOCOL],
            additional_headers={"Cookie": self.cookie} | headers,
            max_size=None,
            open_timeout=10.0,
        )

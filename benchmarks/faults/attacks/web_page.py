"""Attacks of other web pages, and of those who have not entered, on the page of a stack."""

from __future__ import annotations

import base64
import http.client
import secrets
from collections.abc import Iterator, Mapping
from typing import NamedTuple
from urllib.parse import urlsplit

from benchmarks.faults.attacks.attack import Attack, NoControl
from benchmarks.live_stack import LiveStack

ENTERED, SWITCHED = 200, 101
"""Answers of HTTP: a page, and a WebSocket."""
EVIL = "https://evil.example"
"""Origin of a page of somebody else."""
TIMEOUT = 10.0
"""Longest wait for an answer [s]."""


class Answer(NamedTuple):
    """Answer of the page's web server."""

    status: int
    headers: Mapping[str, str]
    text: str


def attacks(stack: LiveStack) -> Iterator[Attack]:
    """Attack the page.

    Raises:
        NoControl: Not even the person who has the printed address gets in.
    """
    parts = urlsplit(stack.address)
    own, token = parts.netloc, f"/?{parts.query}"

    def ask(path: str, upgrade: bool = False, method: str = "GET", **headers: str) -> Answer:
        sent = {"Host": own, **headers}
        if upgrade:
            key = base64.b64encode(secrets.token_bytes(16)).decode()
            sent |= {"Connection": "Upgrade", "Upgrade": "websocket"}
            sent |= {"Sec-WebSocket-Version": "13", "Sec-WebSocket-Key": key}
        connection = http.client.HTTPConnection("127.0.0.1", parts.port, timeout=TIMEOUT)
        try:
            connection.request(method, path, headers=sent)
            answer = connection.getresponse()
            text = "" if answer.status == SWITCHED else answer.read().decode(errors="replace")
            return Answer(answer.status, dict(answer.getheaders()), text)
        finally:
            connection.close()

    entrance = ask(token)
    if entrance.status != ENTERED:
        raise NoControl(f"the printed address is answered with {entrance.status}")
    cookie = entrance.headers["Set-Cookie"].partition(";")[0]
    page = entrance.text.partition("url=")[2].partition('"')[0].rstrip("/")
    origin = f"http://{own}"
    for path in (page, f"{page}/cell"):
        admitted = ask(path, upgrade=True, Cookie=cookie, Origin=origin)
        if admitted.status != SWITCHED:
            raise NoControl(f"the page's own WebSocket is answered with {admitted.status}")

    def judged(who: str, attempt: str, answer: Answer) -> Attack:
        refused = answer.status >= 400 and "Set-Cookie" not in answer.headers
        return Attack(who, attempt, f"HTTP {answer.status}", refused)

    page_of = "another web page in the same browser"
    for name, path in (("page", page), ("cell", f"{page}/cell")):
        for foreign in (EVIL, f"http://127.0.0.1:{(parts.port or 0) + 1}", "null"):
            answer = ask(path, upgrade=True, Cookie=cookie, Origin=foreign)
            yield judged(page_of, f"WebSocket of the {name}, from {foreign}", answer)
    for foreign in (EVIL, "null"):
        answer = ask(f"{page}/hold", method="POST", Cookie=cookie, Origin=foreign)
        yield judged(page_of, f"POST to hold, from {foreign}", answer)
    rebound = "a foreign name that resolves here (DNS rebinding)"
    for host in (
        "evil.example",
        f"evil.example:{parts.port}",
        f"127.0.0.1.evil.example:{parts.port}",
    ):
        yield judged(rebound, f"the token under {host}", ask(token, Host=host))
        answer = ask(page, upgrade=True, Host=host, Cookie=cookie, Origin=f"http://{host}")
        yield judged(rebound, f"WebSocket under {host}", answer)
    stranger = "somebody without the token"
    forged = f"{cookie.partition('=')[0]}={secrets.token_hex(22)}"
    for attempt, answer in (
        ("the entrance", ask("/")),
        ("a guessed token", ask(f"/?token={secrets.token_hex(32)}")),
        ("the page's path without a cookie", ask(f"{page}/")),
        ("the page's path with a forged cookie", ask(f"{page}/", Cookie=forged)),
        ("WebSocket with a forged cookie", ask(page, True, Cookie=forged, Origin=origin)),
        ("a cookie and a guessed path", ask(f"/{secrets.token_hex(22)}/x/", Cookie=cookie)),
    ):
        yield judged(stranger, attempt, answer)

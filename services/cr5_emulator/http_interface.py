"""HTTP interface on port 22000 of V4: the alarms with their descriptions.

    POST /interface/language   {"type": "en"}
    GET  /protocol/getAlarm    {"errMsg": [{"id": ..., "level": ..., "description": ..., ...}]}

Descriptions are our own and in English, whatever language is chosen.
"""

from __future__ import annotations

import json
import re
import time

from services.cr5_emulator.controller import EMERGENCY_STOP_ALARM, Controller
from shared.cr5.alarms import ALARM_TEXTS, MODE_TEXTS

LANGUAGES = ("zh_cn", "zh_hant", "en", "ja", "de", "es", "ru", "ko", "vi", "fr")
"""Languages that may be chosen."""
SEVERE_LEVEL, ORDINARY_LEVEL = 0, 5
"""Levels of the emergency stop and of other alarms."""
BODY_SIZE_LIMIT = 65536
"""Largest body of a request [bytes]."""
CONTENT_LENGTH = re.compile(
    rb"^content-length:[ \t]*(\d{1,9})[ \t]*\r?$", re.IGNORECASE | re.MULTILINE
)
REQUEST_LINE = re.compile(rb"([A-Z]{1,10}) (/[!-~]*) HTTP/1\.[01]\r?")
REASON_PHRASES = {200: "OK", 400: "Bad Request", 404: "Not Found", 405: "Method Not Allowed"}

HttpAnswer = tuple[int, dict[str, object]]
"""Status and content."""


class HttpRequestReader:
    """Reader that splits a stream of bytes into requests: method, path, body."""

    def __init__(self) -> None:
        self._bytes = b""

    def feed(self, data: bytes) -> list[tuple[str, str, bytes]]:
        """Return the requests that the bytes complete; a malformed one has an empty method."""
        self._bytes += data
        found = []
        while b"\r\n\r\n" in self._bytes:
            head, _, rest = self._bytes.partition(b"\r\n\r\n")
            length = CONTENT_LENGTH.search(head)
            size = int(length.group(1)) if length else 0
            if size > BODY_SIZE_LIMIT:
                self._bytes = b""
                return [*found, ("", "", b"")]
            if len(rest) < size:
                break
            line = REQUEST_LINE.fullmatch(head.partition(b"\n")[0])
            method, path = (b.decode() for b in line.groups()) if line else ("", "")
            found.append((method, path, rest[:size]))
            self._bytes = rest[size:]
        if len(self._bytes) > 2 * BODY_SIZE_LIMIT:
            self._bytes = b""
            found.append(("", "", b""))
        return found


class HttpInterface:
    """Answers requests for the controller's alarms."""

    def __init__(self, controller: Controller) -> None:
        self._controller = controller
        self._since: dict[int, float] = {}
        """Time at which each alarm was raised [s since 1970]."""

    def watch(self, now: float) -> None:
        """Record the time of new alarms. Args: now: [s since 1970]."""
        self._since = {n: self._since.get(n, now) for n in self._controller.alarms}

    def answer(self, method: str, path: str, body: bytes) -> bytes:
        """Return the response to a request."""
        status, content = self._answer(method, path.partition("?")[0], body)
        text = json.dumps(content).encode()
        head = (
            f"HTTP/1.1 {status} {REASON_PHRASES[status]}\r\nContent-Type: application/json\r\n"
            f"Content-Length: {len(text)}\r\n\r\n"
        )
        return head.encode() + text

    def _answer(self, method: str, path: str, body: bytes) -> HttpAnswer:
        match method, path:
            case "", _:
                return 400, {}
            case "POST", "/interface/language":
                return (200 if _language(body) in LANGUAGES else 400), {}
            case "GET", "/protocol/getAlarm":
                return 200, {"errMsg": [self._alarm(n) for n in self._controller.alarms]}
            case _, "/interface/language" | "/protocol/getAlarm":
                return 405, {}
        return 404, {}

    def _alarm(self, number: int) -> dict[str, object]:
        when = time.gmtime(self._since.get(number, 0.0))
        stop = number == EMERGENCY_STOP_ALARM
        release = "release the emergency stop, then " if stop else ""
        return {
            "id": number,
            "level": SEVERE_LEVEL if stop else ORDINARY_LEVEL,
            "description": ALARM_TEXTS.get(number, "see the vendor's list"),
            "solution": f"{release}clear the error and enable the arm",
            "mode": MODE_TEXTS["v4"][self._controller.mode],
            "date": time.strftime("%Y-%m-%d", when),
            "time": time.strftime("%H:%M:%S", when),
        }


def _language(body: bytes) -> object:
    try:
        content = json.loads(body)
    except ValueError:
        return None
    return content.get("type") if isinstance(content, dict) else None

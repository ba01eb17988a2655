"""Options with which a process joins the bus, and the errors of joining."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

DEFAULT_HUB = "tcp/127.0.0.1:7448"
"""Endpoint of the launcher's hub by default."""


@dataclass(frozen=True)
class BusOptions:
    """Options with which a process joins the bus."""

    namespace: str = "cell"
    """Name of the cell; cells of different names share a network without seeing each other."""
    connect: tuple[str, ...] = (DEFAULT_HUB,)
    """Zenoh endpoints to connect to, at once or as soon as they exist."""
    listen: tuple[str, ...] = ("tcp/127.0.0.1:0",)
    """Zenoh endpoints to listen on; port 0 takes any free port."""
    mode: Literal["peer", "client", "router"] = "peer"
    """Zenoh mode of this process."""
    settings: Path | None = None
    """JSON file of further Zenoh settings by their path, e.g. for TLS, users and access control:
    {"transport/auth/usrpwd/user": "controller"}."""


class BusError(ValueError):
    """The bus cannot be joined; the text is one line with the reason and the way out."""


class Unreachable(BusError):
    """No process answers at the endpoints of the bus."""


def reason_of(error: Exception) -> str:
    """Return what an error of Zenoh says, in one line without places in its source."""
    (line, *_) = str(error).splitlines() or [""]
    if message := re.search(r'msg: "(.*?)"(?:,|\))', line):
        line = message[1]
    return re.sub(r" at /\S+:\d+\.?", "", line)

"""Options with which a process joins the bus, the errors of joining, and the keys of topics."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

DEFAULT_HUB = "tcp/127.0.0.1:7448"
"""Endpoint of the launcher's hub by default."""
_NAMESPACE = re.compile(
    r"(?:[^\x00-\x20*$?#/@][^\x00-\x1f*$?#/]*/)*[^\x00-\x20*$?#/@][^\x00-\x1f*$?#/]*"
)


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


def check_namespace(namespace: str) -> None:
    """Check the name of a cell.

    Raises:
        BusError: Zenoh would refuse it.
    """
    if not _NAMESPACE.fullmatch(namespace):
        raise BusError(
            f"--namespace {namespace!r} names no cell; give a name without * $ ? #, such as cell"
        )


def key_expression(key: str) -> str:
    """Return the Zenoh key expression of a topic's key: a placeholder becomes a wildcard."""
    start, end = key.find("{"), key.find("}")
    return key if start < 0 else f"{key[:start]}*{key[end + 1 :]}"

"""Keys of topics as key expressions of Zenoh."""

from __future__ import annotations

import re

from shared.bus.options import BusError

_NAMESPACE = re.compile(
    r"(?:[^\x00-\x20*$?#/@][^\x00-\x1f*$?#/]*/)*[^\x00-\x20*$?#/@][^\x00-\x1f*$?#/]*"
)


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

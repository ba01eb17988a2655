"""Keys of topics as key expressions of Zenoh."""

from __future__ import annotations


def key_expression(key: str) -> str:
    """Return the Zenoh key expression of a topic's key: a placeholder becomes a wildcard."""
    start, end = key.find("{"), key.find("}")
    return key if start < 0 else f"{key[:start]}*{key[end + 1 :]}"

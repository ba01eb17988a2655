"""Mutation of valid bytes: parts cut out, inserted, overwritten, values replaced."""

from __future__ import annotations

import random

WORDS = (
    "nan",
    "inf",
    "-1",
    "1e308",
    "9" * 400,
    "[]",
    "{}",
    '""',
    '"../x.csv"',
    "true",
    "[[]]",
    "'",
)
"""Texts that replace a value."""


def mutated(valid: bytes, rng: random.Random) -> bytes:
    """Return valid bytes with one to three changes."""
    content = bytearray(valid)
    for _ in range(rng.randrange(1, 4)):
        at = rng.randrange(len(content) + 1)
        match rng.randrange(6):
            case 0:
                content[at : at + rng.randrange(64)] = b""
            case 1:
                content[at:at] = rng.randbytes(rng.randrange(64))
            case 2:
                content[at : at + 8] = rng.choice((b"\0", b"\xff")) * 8
            case 3:
                content[at:] = b""
            case 4:
                _replace_value(content, rng)
            case _:
                if at < len(content):
                    content[at] = rng.randrange(256)
    return bytes(content)


def _replace_value(content: bytearray, rng: random.Random) -> None:
    """Replace what stands behind an equals sign or between two commas."""
    starts = [k for k, byte in enumerate(content) if byte in b"=,"]
    if not starts:
        return
    start = rng.choice(starts) + 1
    end = next((k for k in range(start, len(content)) if content[k] in b"\n,]"), len(content))
    content[start:end] = rng.choice(WORDS).encode()

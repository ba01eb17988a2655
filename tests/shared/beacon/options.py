from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BeaconOptions:
    name: str = "beacon"
    build: str = ""
    """What goes wrong when it is built: "refuse", "library", "compiler" or "crash"."""
    woken: bool = False
    """Whether it is stepped every ten seconds, and by a request."""
    lines_at_end: int = 0
    """Lines that it prints before it ends, one each half a second."""

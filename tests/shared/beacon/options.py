from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class BeaconOptions:
    name: str = "beacon"
    build: str = ""
    """What goes wrong when it is built: "refuse", "library" or "crash"."""

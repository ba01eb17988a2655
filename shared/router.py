"""A router for a cell that spans containers or machines: `python -m shared.router`.

On one machine no router is needed: the launcher's hub does.
"""

from __future__ import annotations

import logging
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import tyro

from shared import bus
from shared.live import Stopped, stopping_on_signals
from shared.logs import to_standard_error

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class RouterOptions:
    """Where the router listens and whom it lets in."""

    listen: tuple[str, ...] = ("tcp/127.0.0.1:7447",)
    settings: Path | None = None
    """A JSON object of further Zenoh settings by their path: TLS, users, access control."""


def main() -> None:
    """Routes until a signal comes."""
    to_standard_error()
    router = tyro.cli(RouterOptions, prog="python -m shared.router")
    options = bus.BusOptions(
        connect=(), listen=router.listen, mode="router", settings=router.settings
    )
    try:
        with stopping_on_signals(), bus.open(options, "router"):
            log.info("routing on %s", ", ".join(router.listen))
            while True:
                time.sleep(3600.0)
    except bus.BusError as error:
        print(f"router: {error}", file=sys.stderr)
        sys.exit(2)
    except Stopped:
        log.info("stopped")


if __name__ == "__main__":
    main()

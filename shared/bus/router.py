"""Router of the bus for a cell that spans containers or machines: `python -m shared.bus.router`.

A cell on one machine needs no router: its processes meet at the launcher's hub.
"""

from __future__ import annotations

import logging
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import tyro

from shared import bus
from shared.runtime.closed_pipe import ending_with_the_reader
from shared.runtime.live import EXIT_BAD_INPUT, Stopped, stopping_on_signals
from shared.runtime.logs import log_to_standard_error

log = logging.getLogger(__name__)

WAIT_PERIOD = 3600.0
"""Duration of one wait for a signal, which ends it early [s]."""


@dataclass(frozen=True)
class RouterOptions:
    """Endpoints and access settings of the router."""

    listen: tuple[str, ...] = (bus.DEFAULT_HUB,)
    """Zenoh endpoints to listen on."""
    settings: Path | None = None
    """JSON file of further Zenoh settings by their path: TLS, users, access control."""


def main() -> None:
    """Route messages until SIGINT or SIGTERM."""
    log_to_standard_error()
    with ending_with_the_reader():
        router = tyro.cli(RouterOptions, prog="python -m shared.bus.router")
    options = bus.BusOptions(
        connect=(), listen=router.listen, mode="router", settings=router.settings
    )
    try:
        with stopping_on_signals(), bus.open(options, "router"):
            log.info("routing on %s", ", ".join(router.listen))
            while True:
                time.sleep(WAIT_PERIOD)
    except bus.BusError as error:
        print(f"router: {error}", file=sys.stderr)
        sys.exit(EXIT_BAD_INPUT)
    except Stopped:
        log.info("stopped")


if __name__ == "__main__":
    main()

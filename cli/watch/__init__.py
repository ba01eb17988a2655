"""`lariat watch`: a running stack in Foxglove or Lichtblick, live and read-only."""

from __future__ import annotations

import asyncio
import secrets
import signal
import sys
from contextlib import suppress
from pathlib import Path

from cli.task import LOCAL, CellOptions
from cli.watch.server import LiveServer
from dashboard.web.secret_files import load_token
from lariat.configuration import ConfigurationError
from shared import bus as buses
from shared.bus import Bus
from stack.client import JOIN_TIMEOUT

MAX_PORT = 65535
"""Largest TCP port."""
POLL_PERIOD = 0.02
"""Time between two looks for messages of the bus [s]."""


def main(
    port: int = 8765,
    token_file: Path | None = None,
    cell: CellOptions = LOCAL,
) -> int:
    """Serve a running stack to Foxglove or Lichtblick on this machine, until Ctrl-C.

    Open the printed address there as a "Foxglove WebSocket" connection. Viewers only read: nothing
    that they send reaches the cell. `lariat export FILE --to foxglove-layout` writes a layout.

    Examples:
      lariat watch
      lariat watch --port 8766 --token-file ~/.lariat-token

    Args:
        port: Port on 127.0.0.1; 0 takes any free one.
        token_file: File with the token that admits viewers; created if missing. Default: a new
            token for each start.
    """
    if not 0 <= port <= MAX_PORT:
        raise ConfigurationError(f"port {port} does not exist; give --port 0…{MAX_PORT}")
    token = load_token(token_file)
    name = f"lariat-{secrets.token_hex(4)}"
    with buses.open(cell.bus, name, timeout=JOIN_TIMEOUT) as bus:
        try:
            asyncio.run(_serve(bus, LiveServer(cell.namespace, token), port))
        except OSError as error:
            raise ConfigurationError(
                f"port {port} cannot be opened ({error.strerror}); choose another --port"
            ) from error
    return 0


async def _serve(bus: Bus, server: LiveServer, port: int) -> None:
    # An exception of a signal could end in any viewer's task, and be lost there.
    stopped = asyncio.Event()
    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, stopped.set)
    messages = bus.subscribe_all()
    async with server.listening(port) as address:
        print(f"{address}  (Ctrl-C ends)", file=sys.stderr, flush=True)
        while not stopped.is_set():
            for message in messages.take():
                server.publish(message)
            with suppress(TimeoutError):
                await asyncio.wait_for(stopped.wait(), POLL_PERIOD)

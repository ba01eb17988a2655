"""The emulated arm on a machine that is too slow for it."""

from __future__ import annotations

import asyncio
import contextlib
import time
from types import SimpleNamespace

import pytest

from services.cr5_emulator.tcp_server import LONGEST_ADVANCE, TcpServer
from shared.runtime.clock import SystemClock

pytestmark = pytest.mark.live


class SlowEmulator:
    """Emulator that takes twice the time that it advances by."""

    ports = ()
    options = SimpleNamespace(firmware="v3")

    def __init__(self, start: float) -> None:
        self.now = start
        self.advances: list[float] = []

    def advance_to(self, now: float) -> None:
        self.advances.append(now - self.now)
        time.sleep(2.0 * self.advances[-1])
        self.now = now


def test_emulator_that_cannot_keep_up_still_serves_its_clients() -> None:
    clock = SystemClock()
    emulator = SlowEmulator(clock.now() * 1e-9)

    async def serve() -> None:
        server = TcpServer(emulator, clock)  # pyright: ignore[reportArgumentType]
        with contextlib.suppress(TimeoutError):
            await asyncio.wait_for(server.run("127.0.0.1", None), 1.0)

    asyncio.run(serve())
    assert len(emulator.advances) > 5
    assert max(emulator.advances) <= LONGEST_ADVANCE + 1e-6

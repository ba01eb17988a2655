"""TCP server around one emulator: its ports on a loopback or network address, on the wall clock."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from pathlib import Path

from services.cr5_emulator.connection import Connection
from services.cr5_emulator.emulator import Emulator
from shared.runtime.clock import SystemClock

STEP_PERIOD = 0.002
"""Wall time between two steps of the emulator [s]."""
LONGEST_ADVANCE = 0.05
"""Longest time by which the emulator advances before clients are served again [s]. One that gets
too little of a core to keep up with the clock runs late."""
HEARTBEAT_PERIOD = 1.0
"""Wall time between two touches of the heartbeat file [s]."""
READ_SIZE = 65536
"""Largest read from a socket [bytes]."""
WRITE_BUFFER_LIMIT = 1_000_000
"""Bytes waiting for a client above which further packets are dropped."""


class TcpServer:
    """Listens on the emulator's ports and steps the emulator."""

    def __init__(self, emulator: Emulator, clock: SystemClock) -> None:
        self._emulator, self._clock = emulator, clock
        self._writers: dict[Connection, asyncio.StreamWriter] = {}

    async def run(self, host: str, heartbeat: Path | None) -> None:
        """Listen until the task is cancelled; touch the heartbeat every second."""
        servers = []
        beating = asyncio.ensure_future(beat(heartbeat))
        try:
            for port in self._emulator.ports:
                servers.append(await asyncio.start_server(self._serve, host, port))
            print(f"ready: CR5 {self._emulator.options.firmware} at {host}", flush=True)
            while True:
                now = self._clock.now() * 1e-9
                self._emulator.advance_to(min(now, self._emulator.now + LONGEST_ADVANCE))
                self._flush()
                await asyncio.sleep(STEP_PERIOD)
        finally:
            beating.cancel()
            for server in servers:
                server.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        handle = writer.get_extra_info("socket")
        handle.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        connection = self._emulator.connect(handle.getsockname()[1])
        if connection is None:
            writer.close()
            return
        self._writers[connection] = writer
        with contextlib.suppress(ConnectionError, OSError):
            while not connection.closed and (data := await reader.read(READ_SIZE)):
                connection.feed(data)
                self._emulator.process()
                self._flush()
        connection.close()
        self._writers.pop(connection, None)
        writer.close()

    def _flush(self) -> None:
        for connection, writer in list(self._writers.items()):
            # A client that does not read must not fill the memory.
            full = writer.transport.get_write_buffer_size() > WRITE_BUFFER_LIMIT
            if writer.is_closing():
                connection.close()
            while (segment := connection.take()) is not None:
                # Writing one segment may reveal that the client is gone.
                if not full and not connection.closed and not writer.is_closing():
                    writer.write(segment)
            if connection.closed:
                self._writers.pop(connection, None)
                writer.close()


async def beat(heartbeat: Path | None) -> None:
    """Touch a file every second, as long as the event loop runs; without a file only wait."""
    while True:
        if heartbeat:
            heartbeat.touch()
        await asyncio.sleep(HEARTBEAT_PERIOD)

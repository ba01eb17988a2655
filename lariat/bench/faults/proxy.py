"""The network between a gateway and its arm, made to misbehave: TCP in the middle, on loopback."""

from __future__ import annotations

import asyncio
import random
import threading
from collections.abc import Coroutine, Sequence
from typing import Any, Literal

Weather = Literal["fair", "stuck", "late", "torn", "spoiled"]
"""fair: bytes pass. stuck: nothing does, and comes when it is fair again. late: by `LATENESS`.
torn: in pieces of any size. spoiled: now and then a byte from the arm is another one."""

LATENESS = 0.2
"""[s]"""
PIECE = 300
"""Longest of a torn stream [bytes]."""
SPOILED = 0.1
"""Share of the arm's segments in which a byte is spoiled."""
LOOK = 0.002
"""Between two looks at the weather [s]."""


class Proxy:
    """Passes connections on from one address to another, port by port."""

    def __init__(self, host: str, target: str, ports: Sequence[int], seed: int = 0) -> None:
        """Listens at once. Args: host: Where. target: The arm's own address."""
        self.weather: Weather = "fair"
        self._host, self._target = host, target
        self._random = random.Random(seed)
        self._writers: set[asyncio.StreamWriter] = set()
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self._servers = [self._do(self._listen(port)) for port in ports]

    def cut(self) -> None:
        """Closes every connection; new ones are accepted."""
        self._do(self._cut())

    def close(self) -> None:
        """Ends it."""
        for server in self._servers:
            self._loop.call_soon_threadsafe(server.close)
        self.cut()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(2.0)

    def _do(self, work: Coroutine[Any, Any, Any]) -> Any:
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(5.0)

    async def _cut(self) -> None:
        for writer in list(self._writers):
            writer.transport.abort()

    async def _listen(self, port: int) -> asyncio.Server:
        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            try:
                far_reader, far_writer = await asyncio.open_connection(self._target, port)
            except OSError:
                # As if nobody listened here.
                writer.transport.abort()
                return
            self._writers |= {writer, far_writer}
            await asyncio.gather(
                self._pass(reader, far_writer, from_arm=False),
                self._pass(far_reader, writer, from_arm=True),
            )
            self._writers -= {writer, far_writer}

        return await asyncio.start_server(serve, self._host, port)

    async def _pass(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, from_arm: bool
    ) -> None:
        """Passes one direction on, in order, until it ends."""
        queue: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        sender = asyncio.ensure_future(self._send(queue, writer, from_arm))
        try:
            while data := await reader.read(65536):
                late = LATENESS if self.weather == "late" else 0.0
                queue.put_nowait((self._loop.time() + late, data))
        except OSError:
            pass
        finally:
            sender.cancel()
            writer.transport.abort()

    async def _send(
        self,
        queue: asyncio.Queue[tuple[float, bytes]],
        writer: asyncio.StreamWriter,
        from_arm: bool,
    ) -> None:
        while True:
            due, data = await queue.get()
            while self.weather == "stuck" or self._loop.time() < due:
                await asyncio.sleep(LOOK)
            if self.weather == "spoiled" and from_arm and self._random.random() < SPOILED:
                place = self._random.randrange(len(data))
                data = data[:place] + bytes([self._random.randrange(256)]) + data[place + 1 :]
            if self.weather == "torn":
                while data:
                    size = self._random.randint(1, PIECE)
                    writer.write(data[:size])
                    data = data[size:]
                    await asyncio.sleep(0)
            else:
                writer.write(data)

"""The network between a gateway and its arm, made to misbehave: TCP in the middle, on loopback.

    python -m benchmarks.faults.proxy HOST TARGET PORT...

It is a process of its own, so that it never waits for whoever injects the faults. Each line that it
reads is a weather, or `cut`.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
import sys
from typing import Literal, get_args

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

    def __init__(self, target: str, seed: int = 0) -> None:
        """Args: target: The arm's own address."""
        self.weather: Weather = "fair"
        self._target = target
        self._random = random.Random(seed)
        self._writers: set[asyncio.StreamWriter] = set()

    def cut(self) -> None:
        """Closes every connection; new ones are accepted."""
        for writer in list(self._writers):
            writer.transport.abort()

    async def listen(self, host: str, port: int) -> asyncio.Server:
        """Passes on what comes to a port."""

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            try:
                far_reader, far_writer = await asyncio.open_connection(self._target, port)
            except OSError:
                # As if nobody listened here.
                writer.transport.abort()
                return
            both = {writer, far_writer}
            self._writers |= both
            await asyncio.gather(
                self._pass(reader, far_writer, from_arm=False),
                self._pass(far_reader, writer, from_arm=True),
            )
            self._writers -= both

        return await asyncio.start_server(serve, host, port)

    async def _pass(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, from_arm: bool
    ) -> None:
        """Passes one direction on, in order, until it ends."""
        queue: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        sender = asyncio.ensure_future(self._send(queue, writer, from_arm))
        now = asyncio.get_running_loop().time
        try:
            while data := await reader.read(65536):
                late = LATENESS if self.weather == "late" else 0.0
                queue.put_nowait((now() + late, data))
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
        now = asyncio.get_running_loop().time
        while not writer.transport.is_closing():
            due, data = await queue.get()
            while self.weather == "stuck" or now() < due:
                await asyncio.sleep(LOOK)
            if self.weather == "spoiled" and from_arm and self._random.random() < SPOILED:
                place = self._random.randrange(len(data))
                data = data[:place] + bytes([self._random.randrange(256)]) + data[place + 1 :]
            while self.weather == "torn" and data:
                size = self._random.randint(1, PIECE)
                writer.write(data[:size])
                data = data[size:]
                await asyncio.sleep(0)
            writer.write(data)


async def main(host: str, target: str, *ports: str) -> None:
    """Passes on until standard input ends."""
    proxy = Proxy(target)
    for port in ports:
        await proxy.listen(host, int(port))
    reader = asyncio.StreamReader()
    loop = asyncio.get_running_loop()
    await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), sys.stdin)
    print("ready", flush=True)
    while line := (await reader.readline()).decode().strip():
        if line == "cut":
            proxy.cut()
        elif line in get_args(Weather):
            proxy.weather = line


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main(*sys.argv[1:]))

"""TCP proxy between a gateway and its arm that simulates a faulty network, on loopback.

    python -m benchmarks.faults.tcp_proxy HOST TARGET PORT...

It is a process of its own, so that injecting faults never delays it. Each line of its standard
input is a `LineCommand`.
"""

from __future__ import annotations

import asyncio
import contextlib
import random
import sys
from typing import Literal, get_args

LineCondition = Literal["normal", "blocked", "delayed", "fragmented", "corrupted"]
"""normal: bytes pass. blocked: bytes are held until the condition changes. delayed: each way.
fragmented: in pieces of random size. corrupted: some bytes from the arm are replaced."""
LineCommand = LineCondition | Literal["cut"]
"""A condition, or to close every connection."""
LINE_DELAY = 0.2
"""Delay of a delayed line, each way [s]."""
FRAGMENT_SIZE = 300
"""Largest piece of a fragmented stream [bytes]."""
CORRUPTION_PROBABILITY = 0.1
"""Probability that a segment from the arm has a corrupted byte."""
POLL_INTERVAL = 0.002
"""Time between two checks of the condition [s]."""
READ_SIZE = 65536
"""Largest read from a socket [bytes]."""


class Proxy:
    """Forwards connections from one address to another, port by port."""

    def __init__(self, target: str, seed: int = 0) -> None:
        """Args: target: Address of the arm. seed: Seed of fragments and corruption."""
        self.condition: LineCondition = "normal"
        self._target = target
        self._random = random.Random(seed)
        self._writers: set[asyncio.StreamWriter] = set()

    def cut(self) -> None:
        """Close every connection; new ones are accepted."""
        for writer in list(self._writers):
            writer.transport.abort()

    async def listen(self, host: str, port: int) -> asyncio.Server:
        """Forward the connections to a port."""

        async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
            try:
                far_reader, far_writer = await asyncio.open_connection(self._target, port)
            except OSError:
                # As if nothing listened on this port.
                writer.transport.abort()
                return
            both = {writer, far_writer}
            self._writers |= both
            await asyncio.gather(
                self._forward(reader, far_writer, from_arm=False),
                self._forward(far_reader, writer, from_arm=True),
            )
            self._writers -= both

        return await asyncio.start_server(serve, host, port)

    async def _forward(
        self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter, from_arm: bool
    ) -> None:
        """Forward one direction, in order, until it ends."""
        queue: asyncio.Queue[tuple[float, bytes]] = asyncio.Queue()
        sender = asyncio.ensure_future(self._send(queue, writer, from_arm))
        now = asyncio.get_running_loop().time
        try:
            while data := await reader.read(READ_SIZE):
                delay = LINE_DELAY if self.condition == "delayed" else 0.0
                queue.put_nowait((now() + delay, data))
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
            while self.condition == "blocked" or now() < due:
                await asyncio.sleep(POLL_INTERVAL)
            if (
                self.condition == "corrupted"
                and from_arm
                and self._random.random() < CORRUPTION_PROBABILITY
            ):
                index = self._random.randrange(len(data))
                data = data[:index] + bytes([self._random.randrange(256)]) + data[index + 1 :]
            while self.condition == "fragmented" and data:
                size = self._random.randint(1, FRAGMENT_SIZE)
                writer.write(data[:size])
                data = data[size:]
                await asyncio.sleep(0)
            writer.write(data)


async def main(host: str, target: str, *ports: str) -> None:
    """Forward until standard input ends."""
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
        elif line in get_args(LineCondition):
            proxy.condition = line  # pyright: ignore[reportAttributeAccessIssue]


if __name__ == "__main__":
    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(main(*sys.argv[1:]))

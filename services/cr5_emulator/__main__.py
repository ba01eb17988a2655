"""The emulated arm on real sockets: `python -m services.cr5_emulator --help`."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import socket
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import tyro

from services.cr5_emulator.core import Connection, Emulator
from services.cr5_emulator.motion_log import MotionLog
from services.cr5_emulator.options import FAULTS, Options
from shared.clock import SystemClock
from shared.scenario import load

NICENESS = -15
AUTOGROUP = Path("/proc/self/autogroup")


@dataclass(frozen=True)
class Arguments:
    """Plays a Dobot CR5 on its real ports at a loopback address.

    Every switch under --arm answers a question that the maker's documents leave open. Faults begin
    with the emulator, or so many seconds later when written NAME@SECONDS.
    """

    host: str = "127.0.0.31"
    """Address to listen on; ports are the arm's own."""
    firmware: str = "v3"
    """v3 or v4."""
    calibrated: bool = False
    """Its geometry differs from the nominal one by about a millimetre."""
    scenario: Path | None = None
    """Plays the arm of one end of this scenario: its firmware, geometry and start."""
    side: Literal["left", "right"] = "right"
    """Which end."""
    fault: tuple[str, ...] = ()
    """Names of faults, see --list-faults."""
    log: Path | None = None
    """File for the arm's own log of its joints, a CSV row every 8 ms; continued when it exists."""
    list_faults: bool = False
    """Says what faults there are, and ends."""
    arm: Options = field(default_factory=Options)


class Shell:
    """Sockets round one emulator."""

    def __init__(self, emulator: Emulator, clock: SystemClock) -> None:
        self._emulator, self._clock = emulator, clock
        self._writers: dict[Connection, asyncio.StreamWriter] = {}

    async def run(self, host: str) -> None:
        """Listens until it is cancelled."""
        servers = []
        try:
            for port in self._emulator.ports:
                servers.append(await asyncio.start_server(self._serve, host, port))
            print(f"ready: CR5 {self._emulator.options.firmware} at {host}", flush=True)
            while True:
                self._emulator.advance_to(self._clock.now() * 1e-9)
                self._flush()
                await asyncio.sleep(0.002)
        finally:
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
            while not connection.closed and (data := await reader.read(65536)):
                connection.feed(data)
                self._emulator.process()
                self._flush()
        connection.close()
        self._writers.pop(connection, None)
        writer.close()

    def _flush(self) -> None:
        for connection, writer in list(self._writers.items()):
            # A client that does not read must not fill the memory.
            full = writer.transport.get_write_buffer_size() > 1_000_000
            if writer.is_closing():
                connection.close()
            while (segment := connection.take()) is not None:
                # The first one may find that the client is gone.
                if not full and not connection.closed and not writer.is_closing():
                    writer.write(segment)
            if connection.closed:
                self._writers.pop(connection, None)
                writer.close()


def main() -> None:
    """Reads the arguments and runs until a signal comes."""
    arguments = tyro.cli(Arguments)
    if arguments.list_faults:
        for name, meaning in FAULTS.items():
            print(f"{name:18} {meaning}")
        return
    try:
        if arguments.firmware not in ("v3", "v4"):
            raise ValueError(f"--firmware {arguments.firmware!r}; there are v3 and v4")
        options = Options(**{**vars(arguments.arm), **_chosen(arguments)})
        log = MotionLog(arguments.log) if arguments.log else None
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from error
    with _going_first():
        code = asyncio.run(_until_signal(options, arguments.host, log))
    raise SystemExit(code)


@contextlib.contextmanager
def _going_first() -> Iterator[None]:
    """A real one has a computer of its own; here it goes first, where the system allows it."""
    with contextlib.suppress(PermissionError):
        os.setpriority(os.PRIO_PROCESS, 0, min(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))
    # Linux may share its cores out between sessions first, and a stack's have theirs set.
    before = None
    with contextlib.suppress(OSError, ValueError):
        before = int(AUTOGROUP.read_text().rpartition(" ")[2])
        AUTOGROUP.write_text(str(min(NICENESS, before)))
    try:
        yield
    finally:
        if before is not None:
            with contextlib.suppress(OSError):
                AUTOGROUP.write_text(str(before))


def _chosen(arguments: Arguments) -> dict[str, Any]:
    """What the first arguments say about the arm."""
    values: dict[str, Any] = {
        "firmware": arguments.firmware,
        "calibrated": arguments.calibrated or arguments.arm.calibrated,
        "faults": (*arguments.arm.faults, *arguments.fault),
    }
    if arguments.scenario is not None:
        # Only a scenario's arm needs Pinocchio.
        from shared.cr5.installation import scenario_joints, tether_of

        scenario = load(arguments.scenario)
        end = scenario.end(arguments.side)
        values |= {
            "firmware": end.firmware,
            "calibrated": end.calibrated,
            "joints": scenario_joints(scenario, arguments.side),
            "tether": arguments.arm.tether or tether_of(scenario, arguments.side),
        }
    return values


async def _until_signal(options: Options, host: str, log: MotionLog | None) -> int:
    clock = SystemClock()
    shell = Shell(Emulator(options, start=clock.now() * 1e-9, watch=log), clock)
    task = asyncio.ensure_future(shell.run(host))
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, task.cancel)
    try:
        await task
    except asyncio.CancelledError:
        return 0
    except OSError as error:
        print(f"cannot listen on {host}: {error}; is another emulator running?", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    main()

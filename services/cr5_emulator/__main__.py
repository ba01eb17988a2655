"""The emulated arm on TCP ports: `python -m services.cr5_emulator --help`."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
import sys
from collections.abc import Coroutine, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import tyro

from lariat.scenario import Scenario, Side, load
from services.cr5_emulator.emulator import Emulator
from services.cr5_emulator.motion_log import MotionLog
from services.cr5_emulator.options import FAULTS, EmulatorOptions
from services.cr5_emulator.tcp_server import TcpServer, beat
from shared.runtime.clock import SystemClock
from shared.runtime.closed_pipe import ending_with_the_reader

EMULATOR_NICENESS = -15
"""Scheduling priority of the emulator, nice(2)."""
AUTOGROUP_FILE = Path("/proc/self/autogroup")
"""Priority of the process's session on Linux, which may be applied before that of the process."""


@dataclass(frozen=True)
class Arguments:
    """Emulates a Dobot CR5 on its ports at a loopback address.

    Each option under --arm settles behaviour that the vendor's documents leave open. A fault begins
    at the start, or later when written NAME@SECONDS.
    """

    host: str = "127.0.0.31"
    """Address to listen on; the port numbers are fixed by the protocol."""
    firmware: str = "v3"
    """Firmware: v3 or v4."""
    calibrated: bool = False
    """Whether the geometry differs from the nominal one by about a millimetre."""
    scenario: Path | None = None
    """Emulate the arm of this scenario: its firmware, geometry and start. An end without a CR5 has
    no arm; the process then waits without opening a port."""
    side: Side = "right"
    """End of the scenario whose arm is emulated."""
    fault: tuple[str, ...] = ()
    """Names of faults, see --list-faults."""
    log: Path | None = None
    """File for the arm's joint log, a CSV row every 8 ms; appended to when it exists."""
    heartbeat: Path | None = None
    """File to touch every second, for an external monitor."""
    list_faults: bool = False
    """Print the names of all faults and exit."""
    arm: EmulatorOptions = field(default_factory=EmulatorOptions)


def main() -> None:
    """Read the arguments and run until SIGINT or SIGTERM."""
    with ending_with_the_reader():
        arguments = tyro.cli(Arguments, prog="python -m services.cr5_emulator")
        if arguments.list_faults:
            for name, meaning in FAULTS.items():
                print(f"{name:18} {meaning}")
            return
    try:
        if arguments.firmware not in ("v3", "v4"):
            raise ValueError(f"--firmware {arguments.firmware!r}: expected v3 or v4")
        scenario = load(arguments.scenario) if arguments.scenario else None
        if scenario and scenario.end(arguments.side).driver != "cr5":
            print(f"idle: ends.{arguments.side} of {scenario.name} is not a CR5", flush=True)
            raise SystemExit(asyncio.run(_until_signal(beat(arguments.heartbeat))))
        options = EmulatorOptions(**_option_values(arguments, scenario))
        log = MotionLog(arguments.log) if arguments.log else None
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        raise SystemExit(2) from error
    clock = SystemClock()
    server = TcpServer(Emulator(options, start=clock.now() * 1e-9, watch=log), clock)
    try:
        with raised_priority():
            code = asyncio.run(_until_signal(server.run(arguments.host, arguments.heartbeat)))
    except OSError as error:
        print(
            f"cannot listen on {arguments.host}: {error}; is another emulator running?",
            file=sys.stderr,
        )
        code = 1
    raise SystemExit(code)


def _option_values(arguments: Arguments, scenario: Scenario | None) -> dict[str, Any]:
    """Return the fields of the arm's options, those of the scenario's end included."""
    values: dict[str, Any] = {
        **vars(arguments.arm),
        "firmware": arguments.firmware,
        "calibrated": arguments.calibrated or arguments.arm.calibrated,
        "faults": (*arguments.arm.faults, *arguments.fault),
    }
    if scenario is not None:
        # Imports Pinocchio, which an arm without a scenario does not need.
        from lariat.arms.cr5_installation import scenario_joints, tether_of

        end = scenario.end(arguments.side)
        values |= {
            "firmware": end.firmware,
            "calibrated": end.calibrated,
            "joints": scenario_joints(scenario, arguments.side),
            "tether": arguments.arm.tether or tether_of(scenario, arguments.side),
        }
    return values


async def _until_signal(work: Coroutine[Any, Any, None]) -> int:
    """Run a coroutine until it fails or a signal ends it; 0 after a signal."""
    task = asyncio.ensure_future(work)
    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, task.cancel)
    with contextlib.suppress(asyncio.CancelledError):
        await task
    return 0


@contextlib.contextmanager
def raised_priority() -> Iterator[None]:
    """Run the block at `EMULATOR_NICENESS`; the session's priority is restored afterwards.

    A real arm has its own computer; the emulator shares one with the stack.
    """
    with contextlib.suppress(PermissionError):
        os.setpriority(
            os.PRIO_PROCESS, 0, min(EMULATOR_NICENESS, os.getpriority(os.PRIO_PROCESS, 0))
        )
    before = None
    with contextlib.suppress(OSError, ValueError):
        before = int(AUTOGROUP_FILE.read_text().rpartition(" ")[2])
        AUTOGROUP_FILE.write_text(str(min(EMULATOR_NICENESS, before)))
    try:
        yield
    finally:
        if before is not None:
            with contextlib.suppress(OSError):
                AUTOGROUP_FILE.write_text(str(before))


if __name__ == "__main__":
    main()

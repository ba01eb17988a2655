"""Router of the bus killed in motion, and started again: `lariat bench faults router`.

Every process is a client of the router, as in containers, so that its death cuts each from all
others. In `lariat up` the hub dies with the launcher and all processes: case `hub-killed`.
"""

from __future__ import annotations

import asyncio
import contextlib
import signal
import subprocess
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import aiohttp
import numpy as np

from benchmarks.faults.arms import Arms
from benchmarks.faults.bench import DEFAULT_SCENARIO
from benchmarks.faults.cell import LINK_TIMEOUT, FaultCell
from benchmarks.faults.holds import Page
from benchmarks.live_stack import free_port
from benchmarks.operator import Operator
from benchmarks.tables import report
from lariat.trajectory import SECOND
from shared.bus import Unreachable
from shared.messages import RUNNING
from shared.recording import Recording
from shared.topics import ARM_STATE
from stack import services
from stack.client import Cell, connect
from stack.launcher import module_entry
from stack.launcher.process import child_command

SPEED = 0.1
"""Speed of the gripper above which the router is killed [m/s]."""
READY_TIMEOUT = 200.0
"""Longest wait for all processes [s]; kernels may have to be compiled."""
NICENESS = -10
"""Scheduling priority of all processes: the gateway must not be suspended by others."""
SETTLING_TIME = 0.05
"""Time after coming to rest before further motion counts [s]."""


@dataclass(frozen=True)
class RouterOutcome:
    """Run whose router was killed."""

    rest_s: float | None
    """Time from the kill until the joints stood, by the arm's own log."""
    drift_rad: float
    """Largest motion of a joint from then until a person agreed to go on."""
    cause: str
    """Cause of the stop."""
    hold_confirmed: bool
    """Whether the page says that a hold without a router was confirmed."""
    hold_said_s: float
    """Time until it says so, or says that it was not."""
    heard_again_s: float
    """Time from the router's new start until every process was heard."""
    reached: bool
    """Whether the goal was reached afterwards."""
    recorded_before_s: float
    """Recorded time of the gateway before the kill."""
    gap_s: float
    """Longest time without a recorded state of the arms."""
    files: int
    """Number of recordings, all read to their end."""


class RoutedCell(FaultCell):
    """Live cell whose processes meet at a router."""

    def start_stack(self) -> None:
        """Start router and services, and connect to them."""
        self.folder = self.emulated.log.parent
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.start_router()
        self._open.callback(lambda: self.end(self.router))
        words = ["--scenario", str(self.emulated.cell_scenario), "--mode", "client"]
        words += ["--connect", self.endpoint, "--listen"]
        for name in services.NAMES:
            self._spawn(f"services.{name}", *words)
        self._spawn("services.recorder", *words, "--folder", str(self.folder / "recordings"))
        log = (self.folder / "page.txt").open("wb")
        self._spawn("dashboard", *words, "--port", str(free_port()), stderr=log, stdout=log)
        deadline = time.monotonic() + LINK_TIMEOUT
        while True:
            try:
                client = connect(Cell((self.endpoint,), "cell", "client"))
                Operator.__init__(self, self._open.enter_context(client))
                break
            except Unreachable:
                if time.monotonic() > deadline:
                    raise
        self.await_all(READY_TIMEOUT)

    def await_all(self, seconds: float) -> None:
        """Wait until every process is heard."""
        self.health.clear()
        names = {*services.NAMES, "recorder", "dashboard"}
        self.wait_until(lambda: self.health.keys() >= names, seconds, "not every process is heard")

    def start_router(self) -> None:
        """Start the router."""
        command = module_entry.command("shared.bus.router", "--listen", self.endpoint)
        self.router = subprocess.Popen(child_command(signal.SIGTERM, NICENESS, command))

    def address(self) -> str:
        """Return the page's address."""
        text = (self.folder / "page.txt").read_text()
        return next(word for word in text.split() if "/?token=" in word)

    def _spawn(self, module: str, *words: str, **options) -> None:
        command = child_command(signal.SIGTERM, NICENESS, module_entry.command(module, *words))
        process = subprocess.Popen(command, **options)
        self._open.callback(lambda: self.end(process))

    @staticmethod
    def end(process: subprocess.Popen[bytes]) -> None:
        """End a process."""
        process.terminate()
        process.wait()


def run(seconds: float = 4.0, scenario: Path = DEFAULT_SCENARIO, json: bool = False) -> int:
    """Kill the router in the middle of a motion, press HOLD without it, and start it again.

    Args:
        seconds: Time without a router [s].
        scenario: A scenario with a CR5 at its right end.
        json: Print one JSON object instead of a table.

    Returns:
        0 if the arms stood until a person agreed, the goal was reached and nothing but the time
        without a router is missing in the recording, 1 otherwise.
    """
    with tempfile.TemporaryDirectory() as folder, contextlib.ExitStack() as cleanup:
        arms = Arms(scenario, Path(folder), "v3")
        cleanup.callback(arms.close)
        cell = RoutedCell(arms)
        cleanup.callback(cell.end_stack)
        outcome = asyncio.run(_run_with_kill(cell, seconds))
    report([outcome], json=json)
    stood = outcome.rest_s is not None and outcome.drift_rad < 2e-3
    whole = outcome.recorded_before_s > 0.0 and outcome.gap_s < seconds + outcome.heard_again_s
    return 0 if stood and whole and outcome.reached and not outcome.hold_confirmed else 1


async def _run_with_kill(cell: RoutedCell, seconds: float) -> RouterOutcome:
    cell.wait_until(lambda: cell.arms_connected, LINK_TIMEOUT, "the arm is not connected")
    cell.arm()
    async with aiohttp.ClientSession() as session:
        page = Page(session, cell.address())
        await page.open()
        cell.start_motion()
        cell.wait_until_fast(SPEED)
        cell.router.kill()
        killed, stamp = cell.now(), cell.arms.stamp
        cell.router.wait()
        hold_said, hold_confirmed = await page.hold(0)
        await asyncio.sleep(max(killed + seconds - cell.now(), 0.0))
    cell.start_router()
    begun = cell.now()
    cell.await_all(LINK_TIMEOUT)
    heard_again, consent, cause = cell.now() - begun, cell.now(), cell.arms.cause
    cell.acknowledge()
    if cell.task.state != RUNNING:
        cell.start_motion(new_goal=False)
    cell.wait_until_reached()
    log = cell.joint_log()
    rest = log.rest_after(killed, consent)
    drift = log.moved(killed + (rest or 0.0) + SETTLING_TIME, consent)
    cell.end_stack()
    files = sorted((cell.folder / "recordings").glob("*.mcap"))
    stamps = [e.parse().stamp for f in files for e in Recording.open(f).messages([ARM_STATE.key])]
    times = np.sort(stamps) / SECOND
    before = times[times <= stamp / SECOND]
    return RouterOutcome(
        rest_s=rest,
        drift_rad=round(drift, 5),
        cause=cause,
        hold_confirmed=hold_confirmed,
        hold_said_s=round(hold_said, 2),
        heard_again_s=round(heard_again, 1),
        reached=True,
        recorded_before_s=round(float(np.ptp(before)), 1),
        gap_s=round(float(np.max(np.diff(times))), 1),
        files=len(files),
    )

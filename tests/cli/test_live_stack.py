"""The whole stack as a person has it: real processes, the camera, the verbs, a recording."""

from __future__ import annotations

import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import psutil
import pytest

from benchmarks.child_processes import child_processes
from shared import topics
from shared.messages import REACHED, ArmStates
from shared.recording import Recording
from shared.runtime.free_port import free_port
from stack.launcher import module_entry
from tests.shared.cell import Cell, until

pytestmark = pytest.mark.live

SCENARIO = Path(__file__).parents[2] / "scenarios/three-cylinders.toml"


class Live:
    """`lariat up` on free ports, the test's ear on its bus, and its verbs.

    It is started where folders bear the names of our packages: none of them may be imported.
    """

    def __init__(self, cell: Cell, folder: Path) -> None:
        self._cell = cell
        self._log = folder / "log"
        for name in ("shared", "services", "dashboard"):
            (folder / name).mkdir()
            (folder / name / "__init__.py").write_text("raise ImportError('shadowed')")
        self.scenario = Path(shutil.copy(SCENARIO, folder / "mine.toml"))
        command = [sys.executable, *module_entry.command("cli", "up", str(self.scenario))]
        command += ["--port", str(cell.port), "--namespace", cell.namespace]
        command += ["--dashboard-port", str(free_port())]
        with self._log.open("w") as log:
            self.process = subprocess.Popen(
                command, cwd=folder, stdout=log, stderr=subprocess.STDOUT
            )
        # Kernels that are not in the cache are compiled first.
        until(lambda: "dashboard at" in self.log or self.process.poll() is not None, 300.0)
        assert self.process.poll() is None, self.log
        bus = cell("test")
        self.arm = bus.subscribe(topics.ARM_STATE)
        self.health = bus.subscribe(topics.HEALTH)

    @property
    def log(self) -> str:
        return self._log.read_text()

    def say(self, *words: str) -> dict:
        """One verb, and its JSON answer."""
        answer = self._said(*words)
        assert answer.stdout, answer.stderr
        return json.loads(answer.stdout)

    def refused(self, *words: str) -> str:
        """Why a verb was refused."""
        answer = self._said(*words)
        assert answer.returncode == 1, answer.stdout
        return answer.stderr

    def _said(self, *words: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [sys.executable, "-m", "cli", *words, "--json", *self._cell.arguments],
            capture_output=True,
            text=True,
            timeout=60.0,
        )

    def pid(self, service: str) -> int:
        pids: dict[str, int] = {}

        def known() -> bool:
            pids.update({i.message.service: i.message.process for _, i in self.health.take()})
            return service in pids

        until(known)
        return pids[service]

    def listening(self) -> set[str]:
        """Names of the processes that listen where every user of the machine, but no other machine
        can connect.
        """
        launcher = psutil.Process(self.process.pid)
        names = {launcher.pid: "__main__", **child_processes(launcher.pid)}
        heard = {pid: psutil.Process(pid).net_connections("tcp") for pid in names}
        listeners = [(p, c) for p in names for c in heard[p] if c.status == psutil.CONN_LISTEN]
        assert {c.laddr.ip for _, c in listeners} == {"127.0.0.1"}
        return {names[pid] for pid, _ in listeners}

    def arms(self) -> list[ArmStates]:
        return [i.message for _, i in self.arm.take()]

    def newest_arms(self) -> ArmStates:
        seen: list[ArmStates] = []
        until(lambda: seen.extend(self.arms()) or seen, 5.0)
        return seen[-1]

    def go_on(self) -> None:
        """Acknowledge a stop, and resume as soon as the arms are ready."""
        self.say("ack")
        until(lambda: self._said("resume").returncode == 0, 30.0)

    def until_moving(self, seconds: float) -> None:
        until(lambda: any(a.mode == ArmStates.MOVING for a in self.arms()), seconds)

    def until_reached(self, seconds: float) -> None:
        """A machine that is too busy makes the arms hold; a person looks, and goes on."""
        deadline = time.monotonic() + seconds
        status = self.say("status")
        while time.monotonic() < deadline:
            if status["task"]["state"] == "reached":
                return
            if status["arms"]["needs_acknowledgement"]:
                self.go_on()
            status = self.say("status")
        raise AssertionError(f"not reached: {status}\n{self.log}")


@pytest.fixture
def live(tmp_path: Path) -> Iterator[Live]:
    with ExitStack() as stack:
        cell = Cell(stack, hub=False)
        live = Live(cell, tmp_path)
        try:
            yield live
        finally:
            live.process.send_signal(signal.SIGINT)
            live.process.wait(timeout=10.0)


def test_the_stack_reaches_its_goal_survives_a_death_and_records_it(
    live: Live, tmp_path: Path
) -> None:
    assert live.say("goal", str(SCENARIO))["state"] == "idle"
    assert live.say("start")["state"] == "running"
    live.until_moving(60.0)
    assert live.listening() <= {"__main__", "dashboard"}, "others reach hub and page alone"

    # The controller dies in the middle of a motion; the file of the cell is not there any more.
    live.scenario.unlink()
    victim = live.pid("controller")
    live.arms()
    os.kill(victim, signal.SIGKILL)
    killed = time.time_ns()
    seen: list[ArmStates] = []
    until(lambda: seen.extend(live.arms()) or (seen and seen[-1].needs_acknowledgement), 5.0)
    braking = next(a.stamp for a in seen if a.braking or a.mode == ArmStates.HOLDING)
    assert 1e-9 * (braking - killed) < 0.5

    # Another one takes its place, and nothing moves until a person has looked.
    until(lambda: live.log.count("controller | ready") == 2, 120.0)
    rest = live.newest_arms()
    assert "acknowledge and resume first" in live.refused("start")
    time.sleep(1.0)
    later = live.newest_arms()
    assert later.needs_acknowledgement
    for before, after in zip(rest.arms, later.arms, strict=True):
        np.testing.assert_allclose(after.position, before.position, atol=1e-4)
    live.go_on()
    if live.say("status")["task"]["state"] != "running":
        live.say("start")
    live.until_reached(120.0)
    status = live.say("status")
    assert status["task"]["error_mm"] < 5.0
    # The recorder, at the lowest priority, may still be busy with the end of the run.
    rows = lambda: live.say("status")["processes"]  # noqa: E731
    until(lambda: all(row["ok"] for row in rows().values()), 30.0)

    live.process.send_signal(signal.SIGINT)
    assert live.process.wait(timeout=10.0) == 0

    reached = 0
    files = (tmp_path / "recordings").glob("*.mcap")
    for file in sorted(path for path in files if not path.name.endswith("_idle.mcap")):
        states = Recording.open(file).messages([topics.TASK_STATE.key])
        reached += any(entry.parse().state == REACHED for entry in states)
    assert reached == 1

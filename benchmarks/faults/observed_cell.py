"""Live cell for fault injection: its processes, and the newest of what they say on the bus."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.faults.joint_log import JointLog
from benchmarks.faults.processes import START_TIMEOUT, CellProcesses, DeadlineMissed, wait_until
from lariat.scenario import Scenario
from shared import topics
from shared.messages import ArmStates, StackState
from shared.runtime.clock import SystemClock
from stack import client, services
from stack.client import Client

LINK_TIMEOUT = 20.0
"""Time limit for all arms to be connected [s]."""
CONNECTED_LINK_RATE = 100.0
"""Packets of an arm that is connected [Hz]."""
STOP_TIMEOUT = 5.0
"""Time limit for the gateway to stop after an arm has been replaced [s]."""
SLICE = 0.02
"""Time for which a process that is slowed down runs, and stands, in turn [s]."""
OTHER_GATEWAY_TIMEOUT = 15.0
"""Time limit for another gateway to be heard once its line is open [s]."""


class ObservedCell:
    """A live stack and its processes, and what they say on the bus."""

    def __init__(self, processes: CellProcesses) -> None:
        """Start the stack."""
        self.processes = processes
        self.scenario: Scenario = processes.scenario
        self.clock = SystemClock()
        self._service_pids: dict[str, int] = {}
        self._own_boot = ""
        """Boot id of the cell's gateway, once another one may speak; empty before."""
        self._other_heard = False
        self.start_stack()

    # Connection

    def start_stack(self) -> None:
        """Start all services and wait until they are ready."""
        self.processes.start_stack()
        self.connect()
        if self.processes.routed:
            heard = lambda: set(services.NAMES) <= self._service_pids.keys()  # noqa: E731
            self.wait_until(heard, START_TIMEOUT, "not every service published its health")

    def connect(self) -> None:
        """Connect to the stack."""
        mode = "client" if self.processes.routed else "peer"
        hub = f"tcp/127.0.0.1:{self.processes.port}"
        self._connection = client.connect(client.Cell((hub,), self.processes.namespace, mode))
        self.client: Client = self._connection.__enter__()
        self._arm = self.client.bus.subscribe(topics.ARM_STATE)
        self._task = self.client.bus.subscribe(topics.TASK_STATE)
        self._health = self.client.bus.subscribe(topics.HEALTH)
        self._stack = self.client.bus.subscribe(topics.STACK_STATE)
        self.states: list[ArmStates] = []
        """Messages of the gateway since they were last cleared."""
        self.task_state = None
        """Newest message of the controller."""
        self.stack_state = StackState()
        """Newest message of the launcher."""
        self.notes: dict[str, list[str]] = {}
        """Problems that the services have stated in their health, by service, each once."""

    def disconnect(self) -> None:
        """Disconnect from the stack."""
        self._connection.__exit__(None, None, None)

    def close(self) -> None:
        """Disconnect and end all processes."""
        self.disconnect()
        self.processes.close()

    def send_signal(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a process.

        Args:
            name: A service, `router`, `lariat` (the launcher), `emulator` or `guard`: the gateway's
                guard of its last arm.
            number: The signal.
        """
        pid = self.processes.pid(name)
        if pid is None:
            self.update()
            pid = guards_of(self._service_pids["robot_gateway"])[-1] if name == "guard" else None
        if pid is None:
            # Recorder and dashboard are not needed for a cell to be ready: they may be heard later.
            known = lambda: name in self._service_pids  # noqa: E731
            self.wait_until(known, LINK_TIMEOUT, f"no {name}")
        os.kill(pid or self._service_pids[name], number)

    def slow_down(self, name: str, seconds: float) -> None:
        """Freeze a process for half of the time.

        Args:
            name: A service.
            seconds: Duration [s].
        """
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for number in (signal.SIGSTOP, signal.SIGCONT):
                self.send_signal(name, number)
                time.sleep(SLICE)

    def expect_other_gateway(self) -> None:
        """Take the messages of the cell's own gateway alone, until the other one is forgotten."""
        self.wait_until(lambda: bool(self.states), STOP_TIMEOUT, "no state")
        self._own_boot, self._other_heard = self.arms.boot, False

    def forget_other_gateway(self) -> None:
        """Take the messages of every gateway again, after the other one has ended."""
        self.update()
        self._own_boot = ""

    def wait_for_other_gateway(self) -> float:
        """Wait until another gateway is heard, and return the time of that [s]."""
        self.wait_until(lambda: self._other_heard, OTHER_GATEWAY_TIMEOUT, "no other gateway")
        return self.now()

    # State

    def update(self) -> None:
        """Take the messages that have come in."""
        for _, item in self._arm.take():
            if self._own_boot in ("", item.message.boot):
                self.states.append(item.message)
            else:
                self._other_heard = True
        for _, item in self._task.take():
            self.task_state = item.message
        for _, item in self._health.take():
            self._service_pids[item.message.service] = item.message.process
            notes = self.notes.setdefault(item.message.service, [])
            if item.message.note and item.message.note not in notes:
                notes.append(item.message.note)
        for _, item in self._stack.take():
            self.stack_state = item.message

    @property
    def arms(self) -> ArmStates:
        """Newest message of the gateway."""
        return self.states[-1] if self.states else ArmStates()

    @property
    def arms_connected(self) -> bool:
        """Whether the gateway gets feedback of every arm."""
        return all(a.driver != "cr5" or a.link_rate > CONNECTED_LINK_RATE for a in self.arms.arms)

    def process_state(self, name: str) -> str:
        """Return the state of a process as the launcher reports it; empty when unknown."""
        states = {p.service: p.state for p in self.stack_state.processes}
        return states.get(name, "")

    def wait_until(self, condition: Callable[[], bool], seconds: float, failure: str) -> None:
        """Wait for a condition of the state.

        Raises:
            DeadlineMissed: With the state of arms and task.
        """

        def updated() -> bool:
            self.update()
            return condition()

        try:
            wait_until(updated, seconds, failure)
        except DeadlineMissed as missed:
            a, t = self.arms, self.task_state
            task = f"task {t.state}: {t.reason}" if t else "no task"
            mode = ArmStates.Mode.Name(a.mode)
            raise DeadlineMissed(f"{missed}; arms {mode} ({a.cause}: {a.reason}), {task}") from None

    def joint_log(self) -> JointLog:
        """Read the observed arm's log."""
        return JointLog.read(self.processes.log)

    def now(self) -> float:
        """Return the time on the clock of the log [s]."""
        return 1e-9 * self.clock.now()


def guards_of(gateway: int) -> list[int]:
    """Return the ids of the guards that a gateway's process has started, the oldest first."""
    children = Path(f"/proc/{gateway}/task/{gateway}/children").read_text(encoding="ascii")
    pids = [int(pid) for pid in children.split()]
    return [p for p in pids if b"guard_process" in Path(f"/proc/{p}/cmdline").read_bytes()]

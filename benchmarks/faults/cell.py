"""Live cell for fault injection, with an operator who arms, acknowledges and sets goals."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable
from pathlib import Path

from benchmarks.faults.joint_log import JointLog
from benchmarks.faults.processes import (
    OBSERVED_SIDE,
    START_TIMEOUT,
    CellProcesses,
    DeadlineMissed,
    wait_until,
)
from shared import topics
from shared.clock import SystemClock
from shared.messages import REACHED, RUNNING, ArmCommand, ArmStates, StackState, TaskRequest
from shared.scenario import Scenario
from stack import client, services
from stack.approach import approach
from stack.client import Client, RequestFailed
from stack.goal_message import goal_message

LINK_TIMEOUT = 20.0
"""Time limit for all arms to be connected [s]."""
CONNECTED_LINK_RATE = 100.0
"""Packets of an arm that is connected [Hz]."""
ENABLE_TIMEOUT = 40.0
"""Time limit for all arms to be ready after a command of the operator [s]."""
STOP_TIMEOUT = 5.0
"""Time limit for the gateway to stop after an arm has been replaced [s]."""
RETRY_PERIOD = 0.2
"""Time between two requests to resume while the arms are being made ready [s]."""
SLICE = 0.02
"""Time for which a process that is slowed down runs, and stands, in turn [s]."""
APPROACH_ATTEMPTS = 3
"""Number of times that the operator holds the button of an approach anew, over what is left."""
OTHER_GATEWAY_TIMEOUT = 15.0
"""Time limit for another gateway to be heard once its line is open [s]."""
SPEED_TIMEOUT = 15.0
"""Time limit for the gripper to reach a speed [s]."""
GOAL_TIMEOUT = 45.0
"""Time limit for the goal to be reached [s]."""


class FaultCell:
    """A live stack, its processes, and its operator."""

    def __init__(
        self,
        scenario: Path,
        folder: Path,
        firmware: str,
        routed: bool = False,
        recorded: bool = False,
        page: bool = False,
    ) -> None:
        """Start everything.

        Args:
            scenario: A scenario with a CR5 at its right end.
            folder: Folder for logs.
            firmware: Firmware of the arms, v3 or v4.
            routed: Whether the services connect through a router; see `CellProcesses`.
            recorded: Whether runs are recorded; see `CellProcesses`.
            page: Whether the dashboard runs.
        """
        self.processes = CellProcesses(scenario, folder, firmware, routed, recorded, page)
        self.scenario: Scenario = self.processes.scenario
        self.clock = SystemClock()
        self._goal = -1
        self._service_pids: dict[str, int] = {}
        self._own_boot = ""
        """Boot id of the cell's gateway, once another one may speak; empty before."""
        self._other_heard = False
        self._button: threading.Thread | None = None
        self._button_held = False
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

    # Operator

    def arm(self) -> str:
        """Arm, with consent to the approach if the gateway asks for it.

        Returns:
            Description for the result: armed, with or without an approach.
        """
        done = "armed"
        if self.client.newest_arm_state().needs_approach:
            done = f"armed, with {self._approach_start()}"
        else:
            self.client.command_arms(ArmCommand.ARM)
        self.states.clear()
        self.wait_until(
            lambda: self.arms.mode in (ArmStates.ARMED, ArmStates.HOLDING) and self._ready(),
            ENABLE_TIMEOUT,
            "the arm did not become ready",
        )
        return done

    def _approach_start(self) -> str:
        """Let the arms approach the start, and return in how many approaches they did.

        On an overloaded machine a sign of life comes late, which ends an approach.
        """
        ended = ""
        for attempt in range(APPROACH_ATTEMPTS):
            if attempt:
                self.wait_until(lambda: not self.arms.braking, STOP_TIMEOUT, ended)
                if self.arms.needs_acknowledgement:
                    self.client.command_arms(ArmCommand.ACKNOWLEDGE)
            shown = self.client.newest_arm_state()
            ended = approach(self.client, shown, shown.approach_distance, lambda: True)
            if not ended:
                return f"{attempt + 1} approaches" if attempt else "an approach to the start"
        raise RequestFailed(f"the approach ended early: {ended}")

    def _ready(self) -> bool:
        """Return whether no person is waited for and every arm follows."""
        return self.arms.may_move and all(
            a.driver != "cr5" or a.mode in ("idle", "running") for a in self.arms.arms
        )

    def hold_approach_button(self) -> None:
        """Begin an approach to the start and hold its button until it is released."""
        away = lambda: self.arms.needs_approach  # noqa: E731
        self.wait_until(away, STOP_TIMEOUT, "the arm is at the start")
        self._button_held = True
        shown = self.client.newest_arm_state()

        def hold() -> None:
            with contextlib.suppress(RequestFailed):
                approach(self.client, shown, shown.approach_distance, lambda: self._button_held)

        self._button = threading.Thread(target=hold, name="approach button")
        self._button.start()

    def release_approach_button(self) -> None:
        """Release the button of the approach, if it is held."""
        self._button_held = False
        if self._button is not None:
            self._button.join()
            self._button = None

    def replace_arm(self, silence: str) -> None:
        """Replace the observed arm, at the scenario's start.

        Args:
            silence: Reaction of the new one when servo points stop.
        """
        self.processes.kill_emulator()
        self.processes.start_emulator(silence)
        # The new arm is at the start, so the next motion goes to the goal.
        self._goal = 1
        self.states.clear()
        self.wait_until(
            lambda: self.arms.needs_acknowledgement, STOP_TIMEOUT, "the replacement went unnoticed"
        )
        self.wait_until(lambda: self.arms_connected, LINK_TIMEOUT, "the arm is not connected")
        self.acknowledge()

    def acknowledge(self) -> None:
        """Acknowledge a hold or fault, resume, and wait until the arms are ready."""
        if self.arms.needs_acknowledgement:
            self.client.command_arms(ArmCommand.ACKNOWLEDGE)
        if self.client.newest_arm_state().needs_approach:
            # A stop on the way to the start is left by another approach only.
            self.arm()
            return
        deadline = time.monotonic() + ENABLE_TIMEOUT
        while True:
            try:
                self.client.command_arms(ArmCommand.RESUME)
                break
            except RequestFailed:
                # The arms are still being made ready.
                if time.monotonic() > deadline:
                    raise
                time.sleep(RETRY_PERIOD)
        self.states.clear()
        self.wait_until(
            lambda: bool(self.states) and self._ready(),
            ENABLE_TIMEOUT,
            "still held after the acknowledgement",
        )

    def start_motion(self, new_goal: bool = True) -> None:
        """Start a run, alternately to the scenario's goal and to its start.

        Args:
            new_goal: Whether to change the goal; otherwise the last one is kept.
        """
        self._goal = (self._goal + 1) % 2 if new_goal else self._goal
        shape = (self.scenario.goal, self.scenario.start)[self._goal]
        if self.task_state is not None and self.task_state.state == RUNNING:
            self.client.request_task(TaskRequest.STOP)
        self.client.request_task(
            TaskRequest.SET_GOAL, goal=goal_message(self.scenario, shape, self.client)
        )
        self.client.request_task(TaskRequest.START)

    def go_to_goal(self) -> None:
        """Start a run to the scenario's goal, and wait until it is reached."""
        self._goal = 1
        self.start_motion()
        self.wait_until_reached()

    def end_run(self) -> None:
        """End the run, if there is one."""
        if self.task_state is not None and self.task_state.state == RUNNING:
            self.client.request_task(TaskRequest.STOP)

    def hold(self) -> None:
        """Hold the arms, and wait until they are held."""
        self.client.command_arms(ArmCommand.HOLD)
        self.wait_until(lambda: self.arms.mode == ArmStates.HOLDING, STOP_TIMEOUT, "not held")

    def disarm(self) -> None:
        """Disarm, and wait until the arms have no power."""
        self.client.command_arms(ArmCommand.DISARM)
        self.wait_until(
            lambda: (
                self.arms.mode == ArmStates.DISARMED and not any(a.powered for a in self.arms.arms)
            ),
            STOP_TIMEOUT,
            "not disarmed, or still powered",
        )

    def wait_until_fast(self, speed: float) -> None:
        """Wait until the gripper exceeds a speed [m/s]."""

        def fast() -> bool:
            arm = next((a for a in self.arms.arms if a.arm == OBSERVED_SIDE), None)
            return arm is not None and sum(v * v for v in arm.linear_velocity) > speed**2

        self.wait_until(fast, SPEED_TIMEOUT, f"the arm does not reach {speed} m/s")

    def wait_until_reached(self) -> int:
        """Wait until the goal is reached; return the number of further holds on the way.

        An overloaded machine makes the cell hold; the operator acknowledges and continues.
        """
        holds = 0
        end = time.monotonic() + GOAL_TIMEOUT
        while True:
            self.wait_until(
                lambda: self.arms.needs_acknowledgement or self._task_is(REACHED),
                max(end - time.monotonic(), 0.0),
                "the goal was not reached",
            )
            if self._task_is(REACHED):
                return holds
            holds += 1
            self.acknowledge()
            if not self._task_is(RUNNING):
                self.start_motion(new_goal=False)

    def _task_is(self, state: int) -> bool:
        return self.task_state is not None and self.task_state.state == state


def guards_of(gateway: int) -> list[int]:
    """Return the ids of the guards that a gateway's process has started, the oldest first."""
    children = Path(f"/proc/{gateway}/task/{gateway}/children").read_text(encoding="ascii")
    pids = [int(pid) for pid in children.split()]
    return [p for p in pids if b"guard_process" in Path(f"/proc/{p}/cmdline").read_bytes()]

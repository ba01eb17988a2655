"""Operator of a live cell for fault injection, who arms, acknowledges and sets goals."""

from __future__ import annotations

import contextlib
import os
import signal
import subprocess
import threading
import time
from pathlib import Path

from benchmarks.faults.arms import OBSERVED_SIDE, Arms
from benchmarks.faults.joint_log import JointLog
from benchmarks.live_stack import LiveStack
from benchmarks.operator import Operator
from shared.bus import Unreachable
from shared.messages import REACHED, RUNNING, ArmCommand, ArmStates, TaskRequest, goal_message
from shared.runtime.clock import SystemClock
from shared.runtime.free_port import free_port
from stack import services
from stack.approach import approach
from stack.client import Cell, RequestFailed, connect
from stack.launcher import module_entry
from stack.launcher.process import child_command
from stack.live_goal import live_goal

LINK_TIMEOUT, STOP_TIMEOUT, ENABLE_TIMEOUT = 20.0, 5.0, 40.0
"""Time limits for all arms to be connected, for the gateway to stop after an arm has been replaced,
and for all arms to be ready after a command of the operator [s]."""
SPEED_TIMEOUT, GOAL_TIMEOUT = 15.0, 45.0
"""Time limits for the gripper to reach a speed, and for the goal to be reached [s]."""
READY_TIMEOUT = 200.0
"""Longest wait for all clients of a router [s]; kernels may have to be compiled."""
CONNECTED_LINK_RATE = 100.0
"""Packets of an arm that is connected [Hz]."""
SLICE = 0.02
"""Time for which a process that is slowed down runs, and stands, in turn [s]."""
RETRY_PERIOD = 0.2
"""Time between two requests to resume while the arms are being made ready [s]."""
APPROACH_ATTEMPTS = 3
"""Number of times that the operator holds the button of an approach anew, over what is left."""
ROUTED_NICENESS = -10
"""Scheduling priority of a router's clients: the gateway must not be suspended by others."""


class FaultCell(Operator):
    """A live stack, its emulated arms, and its operator."""

    def __init__(self, arms: Arms) -> None:
        """Start the stack and wait until it is ready."""
        self.emulated, self.scenario = arms, arms.scenario
        self.clock = SystemClock()
        self._goal = -1
        self._button: threading.Thread | None = None
        self._button_held = False
        self._open = contextlib.ExitStack()
        self.start_stack()

    def start_stack(self) -> None:
        """Start all processes, wait until they are ready, and connect to them."""
        # The folder of the module that lets processes raise an exception at SIGUSR1.
        environment = {"PYTHONPATH": str(Path(__file__).parent / "raising")}
        stack = LiveStack(self.emulated.cell_scenario, environment)
        self._stack_process = self._open.enter_context(stack)
        super().__init__(self._open.enter_context(self._stack_process.connect()))

    def end_stack(self) -> None:
        """Disconnect, and end what is left of the stack."""
        self._open.close()

    def send_signal(self, name: str, number: signal.Signals) -> None:
        """Send a signal to a process.

        It is a service, `lariat` (the launcher), `emulator`, or `guard`: the gateway's guard of its
        last arm.
        """
        self.update()
        if name == "guard":
            pid = guards_of(self.health["robot_gateway"].process)[-1]
        elif name in ("lariat", "emulator"):
            pid = self._stack_process.pid if name == "lariat" else self.emulated.pid
        else:
            # Recorder and dashboard are not needed for a cell to be ready: they may be heard later.
            self.wait_until(lambda: name in self.health, LINK_TIMEOUT, f"no {name}")
            pid = self.health[name].process
        os.kill(pid, number)

    def slow_down(self, name: str, seconds: float) -> None:
        """Freeze a service for half of a time [s]."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for number in (signal.SIGSTOP, signal.SIGCONT):
                self.send_signal(name, number)
                time.sleep(SLICE)

    @property
    def arms_connected(self) -> bool:
        """Whether the gateway gets feedback of every arm."""
        return all(a.driver != "cr5" or a.link_rate > CONNECTED_LINK_RATE for a in self.arms.arms)

    def wait_until_connected(self) -> None:
        """Wait until the gateway gets feedback of every arm."""
        self.wait_until(lambda: self.arms_connected, LINK_TIMEOUT, "the arm is not connected")

    def process_state(self, name: str) -> str:
        """Return the state of a process as the launcher reports it; empty when unknown."""
        return {p.service: p.state for p in self.stack.processes}.get(name, "")

    def joint_log(self) -> JointLog:
        """Read the observed arm's log."""
        return JointLog.read(self.emulated.log)

    def now(self) -> float:
        """Return the time on the clock of the log [s]."""
        return 1e-9 * self.clock.now()

    def arm(self) -> str:
        """Arm, with consent to the approach if the gateway asks for it."""
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
        """Replace the observed arm, at the scenario's start."""
        self.emulated.kill()
        self.emulated.start(silence=silence)
        # The new arm is at the start, so the next motion goes to the goal.
        self._goal = 1
        self.states.clear()
        self.wait_until(
            lambda: self.arms.needs_acknowledgement, STOP_TIMEOUT, "the replacement went unnoticed"
        )
        self.wait_until_connected()
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
        """Start a run, alternately to the scenario's goal and to its start."""
        self._goal = (self._goal + 1) % 2 if new_goal else self._goal
        shape = (self.scenario.goal, self.scenario.start)[self._goal]
        self.end_run()
        self.task = self.client.request_task(
            TaskRequest.SET_GOAL, goal=goal_message(live_goal(self.scenario, shape, self.client))
        )
        if self.task.state != RUNNING:
            self.task = self.client.request_task(TaskRequest.START)

    def go_to_goal(self) -> None:
        """Start a run to the scenario's goal, and wait until it is reached."""
        self._goal = 1
        self.start_motion()
        self.wait_until_reached()

    def end_run(self) -> None:
        """End the run, if there is one."""
        if self.task.state == RUNNING:
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
        holds, end = 0, time.monotonic() + GOAL_TIMEOUT
        while True:
            self.wait_until(
                lambda: self.arms.needs_acknowledgement or self.task.state == REACHED,
                max(end - time.monotonic(), 0.0),
                "the goal was not reached",
            )
            if self.task.state == REACHED:
                return holds
            holds += 1
            self.acknowledge()
            if self.task.state != RUNNING:
                self.start_motion(new_goal=False)


class RoutedCell(FaultCell):
    """Live cell whose processes are clients of a router, as in containers.

    The death of the router cuts each process from all others. In `lariat up` the hub dies with the
    launcher and all processes: case `hub-killed`.
    """

    def start_stack(self) -> None:
        """Start router and services, and connect to them."""
        self.endpoint = f"tcp/127.0.0.1:{free_port()}"
        self.start_router()
        self._open.callback(lambda: _end(self.router))
        folder = self.emulated.log.parent
        words = ["--scenario", str(self.emulated.cell_scenario), "--mode", "client"]
        words += ["--connect", self.endpoint, "--listen"]
        for module, *more in (
            *([f"services.{name}"] for name in services.NAMES),
            ["services.recorder", "--folder", str(folder / "recordings")],
            ["dashboard", "--port", str(free_port())],
        ):
            process = _spawn_client(module, *words, *more, stdout=subprocess.DEVNULL)
            self._open.callback(_end, process)
        deadline = time.monotonic() + LINK_TIMEOUT
        while True:
            try:
                client = connect(Cell((self.endpoint,), "cell", "client"))
                Operator.__init__(self, self._open.enter_context(client))
                break
            except Unreachable:
                if time.monotonic() > deadline:
                    raise
        self.await_all()

    def await_all(self) -> None:
        """Wait until every process is heard."""
        self.health.clear()
        names = {*services.NAMES, "recorder", "dashboard"}
        all_heard = lambda: self.health.keys() >= names  # noqa: E731
        self.wait_until(all_heard, READY_TIMEOUT, "not every process is heard")

    def start_router(self) -> None:
        """Start the router."""
        self.router = _spawn_client("shared.bus.router", "--listen", self.endpoint)

    def kill_router(self) -> None:
        """Kill the router and wait until it is gone."""
        self.router.kill()
        self.router.wait()


def _spawn_client(module: str, *words: str, stdout: int | None = None) -> subprocess.Popen[bytes]:
    command = module_entry.command(module, *words)
    return subprocess.Popen(child_command(signal.SIGTERM, ROUTED_NICENESS, command), stdout=stdout)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.terminate()
    process.wait()


def guards_of(gateway: int) -> list[int]:
    """Return the ids of the guards that a gateway's process has started, the oldest first."""
    children = Path(f"/proc/{gateway}/task/{gateway}/children").read_text(encoding="ascii")
    pids = [int(pid) for pid in children.split()]
    return [p for p in pids if b"guard_process" in Path(f"/proc/{p}/cmdline").read_bytes()]

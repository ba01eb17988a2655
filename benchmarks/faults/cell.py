"""A whole live stack whose arm lies behind a line that can be made to misbehave.

The scenario's CR5 is given an address, as a real one has; there a proxy listens, and behind it the
emulator, which writes down what its joints do. Nothing in the stack knows that.
"""

from __future__ import annotations

import os
import secrets
import signal
import socket
import subprocess
import time
from collections.abc import Callable, Sequence
from pathlib import Path

from benchmarks.faults.motion import JointLog
from shared import topics
from shared.clock import SystemClock
from shared.messages import REACHED, RUNNING, ArmCommand, ArmStates, StackState, TaskRequest
from shared.scenario import Scenario
from stack import client, services
from stack.client import Client, RequestFailed
from stack.goal_message import goal_message
from stack.launcher import module_entry
from stack.launcher.library_environment import LIBRARY_ENVIRONMENT
from stack.launcher.process import child_command
from stack.launcher.programs import NICENESS as SERVICE_NICENESS
from stack.scenario_overrides import load_with

HOST, ARM_HOST = "127.0.0.41", "127.0.0.42"
"""Where the gateway finds its arm, and where that is."""
OTHER_HOST = "127.0.0.43"
"""Where a second arm is, without anything between."""
PORTS = (29999, 30003, 30004)
SIDE, OTHER = "right", "left"
NICENESS = -16
"""Where the system allows it."""
TICK = 0.01


class Missing(RuntimeError):
    """Something did not happen in time."""


class FaultCell:
    """The stack, its arm, and a person who talks to it."""

    def __init__(self, scenario: Path, folder: Path, firmware: str, router: bool = False) -> None:
        """Starts everything.

        Args:
            folder: For logs.
            firmware: Of the arm.
            router: Whether the services meet through a router, as in containers, and nobody keeps
                them; otherwise `lariat up` does.
        """
        self.folder = folder
        self._routed = router
        self._services: dict[str, subprocess.Popen[bytes]] = {}
        self.log = folder / "joints.csv"
        self._source = folder / "arm.toml"
        arm = load_with(scenario, [f"ends.{SIDE}.firmware={firmware}"])
        addresses = [f"ends.{SIDE}.address={HOST}"]
        self.has_other = arm.end(OTHER).driver == "cr5"
        if self.has_other:
            arm = load_with(scenario, [f"ends.{s}.firmware={firmware}" for s in (SIDE, OTHER)])
            addresses.append(f"ends.{OTHER}.address={OTHER_HOST}")
        self._source.write_text(arm.text, encoding="utf-8")
        addressed = load_with(self._source, addresses)
        self._file = folder / "cell.toml"
        self._file.write_text(addressed.text, encoding="utf-8")
        self.scenario: Scenario = addressed
        self.clock = SystemClock()
        self._goal = -1
        self.port = _free_port()
        self.namespace = f"faults-{secrets.token_hex(4)}"
        self.emulator: subprocess.Popen[bytes] | None = None
        self.other_emulator: subprocess.Popen[bytes] | None = None
        self.stack: subprocess.Popen[bytes] | None = None
        self.pids: dict[str, int] = {}
        self.start_emulator()
        if self.has_other:
            self.start_other_emulator()
        ports = PORTS if firmware == "v3" else (29999, 30004)
        addresses = (HOST, ARM_HOST, *(str(p) for p in ports))
        proxy = module_entry.command("benchmarks.faults.proxy", *addresses)
        self.proxy = self._start(proxy)
        self.start_stack()

    # Processes

    def start_emulator(self, silence: str = "hold") -> None:
        """The arm, where the scenario begins."""
        arguments = ("--log", str(self.log), "--arm.silence", silence)
        self.emulator = self._start(self._emulator(ARM_HOST, SIDE, *arguments))

    def start_other_emulator(self) -> None:
        """The arm at the other end."""
        self.other_emulator = self._start(self._emulator(OTHER_HOST, OTHER))

    def _emulator(self, host: str, side: str, *more: str) -> list[str]:
        command = [*module_entry.command("services.cr5_emulator", "--host", host)]
        command += ["--scenario", str(self._source), "--side", side]
        return [*command, "--arm.power-on-time", "0.5", *more]

    def _start(self, arguments: Sequence[str]) -> subprocess.Popen[bytes]:
        """A process that goes before the stack, as an arm and a network do; raises Missing."""
        process = subprocess.Popen(
            child_command(signal.SIGKILL, NICENESS, arguments),
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=_environment(),
            start_new_session=True,
        )
        assert process.stdout is not None
        if not process.stdout.readline().startswith(b"ready"):
            raise Missing(f"{arguments[2]} does not start; is another bench running?")
        return process

    def reap(self, name: str) -> None:
        """Waits until a killed one is gone."""
        self._services[name].wait()

    def weather(self, word: str) -> None:
        """Tells the proxy what the line shall be like."""
        assert self.proxy.stdin is not None
        self.proxy.stdin.write(f"{word}\n".encode())
        self.proxy.stdin.flush()

    def start_stack(self) -> None:
        """All services, until they are ready."""
        if self._routed:
            self.start_router()
            for name in services.NAMES:
                self._start_service(name)
            self.join()
            heard = lambda: set(services.NAMES) <= self.pids.keys()  # noqa: E731
            self.until(heard, 200.0, "not every service spoke")
        else:
            self._start_launcher()
            self.join()

    def start_router(self) -> None:
        """The one that all of them connect to."""
        listen = f"tcp/127.0.0.1:{self.port}"
        self._run("router", module_entry.command("shared.router", "--listen", listen))

        def listens() -> bool:
            with socket.socket() as probe:
                return probe.connect_ex(("127.0.0.1", self.port)) == 0

        until(listens, 20.0, "the router does not listen")

    def _start_service(self, name: str) -> None:
        command = [*module_entry.command(f"services.{name}", "--scenario", str(self._file))]
        command += ["--connect", f"tcp/127.0.0.1:{self.port}", "--namespace", self.namespace]
        self._run(name, [*command, "--mode", "client", "--listen"])

    def _run(self, name: str, arguments: Sequence[str]) -> None:
        """A process that ends with this one."""
        with (self.folder / f"{name}.txt").open("ab") as file:
            self._services[name] = subprocess.Popen(
                child_command(signal.SIGKILL, SERVICE_NICENESS.get(name, 0), arguments),
                stdout=file,
                stderr=subprocess.STDOUT,
                env=_environment(),
                cwd=self.folder,
            )

    def _start_launcher(self) -> None:
        """`lariat up`, until it is ready."""
        output = self.folder / "up.txt"
        with output.open("ab") as file:
            start = file.tell()
            # It puts everything in order when this process is killed.
            arguments = [str(self._file), "--port", str(self.port), "--namespace", self.namespace]
            arguments += ["--no-dashboard", "--no-record"]
            command = child_command(
                signal.SIGTERM, 0, module_entry.command("cli", "up", *arguments)
            )
            self.stack = subprocess.Popen(
                command, stdout=file, stderr=subprocess.STDOUT, env=_environment(), cwd=self.folder
            )
        stack = self.stack

        def up() -> bool:
            if stack.poll() is not None:
                raise Missing(f"the stack ended:\n{output.read_text()[start:]}")
            return "the stack is up" in output.read_text()[start:]

        until(up, 200.0, "the stack did not become ready")

    def join(self) -> None:
        """Listens to the stack anew."""
        mode = "client" if self._routed else "peer"
        cell = client.Cell((f"tcp/127.0.0.1:{self.port}",), self.namespace, mode)
        self._talking = client.connect(cell)
        self.client: Client = self._talking.__enter__()
        self._arm = self.client.bus.subscribe(topics.ARM_STATE)
        self._task = self.client.bus.subscribe(topics.TASK_STATE)
        self._health = self.client.bus.subscribe(topics.HEALTH)
        self._stack = self.client.bus.subscribe(topics.STACK_STATE)
        self.states: list[ArmStates] = []
        self.task_state = None
        self.stack_state = StackState()

    def leave(self) -> None:
        """Listens no more."""
        self._talking.__exit__(None, None, None)

    def close(self) -> None:
        """Ends everything."""
        self.leave()
        arms = (self.emulator, self.other_emulator)
        for process in (*self._services.values(), self.stack, *arms, self.proxy):
            if process is None or process.poll() is not None:
                continue
            process.send_signal(signal.SIGCONT)
            process.send_signal(signal.SIGINT)
            try:
                process.wait(8.0)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def pid(self, name: str) -> int:
        """Of a process of the stack, or of the launcher or the emulator."""
        if name in self._services:
            return self._services[name].pid
        if name in ("lariat", "emulator"):
            process = self.stack if name == "lariat" else self.emulator
            assert process is not None
            return process.pid
        self.look()
        return self.pids[name]

    def send(self, name: str, number: signal.Signals) -> None:
        """A signal to one of them."""
        os.kill(self.pid(name), number)

    # What it says

    def look(self) -> None:
        """Takes what has come in."""
        self.states += [item.message for _, item in self._arm.take()]
        for _, item in self._task.take():
            self.task_state = item.message
        for _, item in self._health.take():
            self.pids[item.message.service] = item.message.process
        for _, item in self._stack.take():
            self.stack_state = item.message

    @property
    def arms(self) -> ArmStates:
        """Newest."""
        return self.states[-1] if self.states else ArmStates()

    @property
    def heard(self) -> bool:
        """Whether every arm is."""
        return all(a.driver != "cr5" or a.link_rate > 100.0 for a in self.arms.arms)

    def process_state(self, name: str) -> str:
        states = {p.service: p.state for p in self.stack_state.processes}
        return states.get(name, "")

    def until(self, condition: Callable[[], bool], seconds: float, otherwise: str) -> None:
        """Looks until something is true."""

        def looked() -> bool:
            self.look()
            return condition()

        try:
            until(looked, seconds, otherwise)
        except Missing as missing:
            a, t = self.arms, self.task_state
            task = f"task {t.state}: {t.reason}" if t else "no task"
            mode = ArmStates.Mode.Name(a.mode)
            raise Missing(f"{missing}; arms {mode} ({a.cause}: {a.reason}), {task}") from None

    def joints(self) -> JointLog:
        """What the arm did so far."""
        return JointLog.read(self.log)

    def now(self) -> float:
        """On the clock of the log [s]."""
        return 1e-9 * self.clock.now()

    # What the person does

    def arm(self) -> str:
        """Arms; twice, when the arm asks for leave to go to the start. How it was done."""
        how = "armed"
        try:
            self.client.command_arms(ArmCommand.ARM)
        except RequestFailed as refused:
            if "arm again" not in str(refused):
                raise
            self.client.command_arms(ArmCommand.ARM)
            how = "armed, agreed to the slow way to the start"
        self.states.clear()
        self.until(
            lambda: self.arms.mode in (ArmStates.ARMED, ArmStates.HOLDING) and self._ready(),
            40.0,
            "the arm did not become ready",
        )
        return how

    def _ready(self) -> bool:
        return not self.arms.needs_acknowledgement and all(
            a.driver != "cr5" or a.mode in ("idle", "running") for a in self.arms.arms
        )

    def change_arm(self, silence: str) -> None:
        """Puts an arm of another nature in its place, at the scenario's start."""
        assert self.emulator is not None
        self.emulator.kill()
        self.emulator.wait()
        self.start_emulator(silence)
        # It stands at the start: the next way is the one to the goal.
        self._goal = 1
        self.states.clear()
        self.until(lambda: self.arms.needs_acknowledgement, 5.0, "the change went unnoticed")
        self.until(lambda: self.heard, 20.0, "the arm is not heard")
        self.acknowledge()

    def acknowledge(self) -> None:
        """Has looked at the cell."""
        self.client.command_arms(ArmCommand.ACKNOWLEDGE)
        self.states.clear()
        self.until(lambda: bool(self.states) and self._ready(), 40.0, "still held after the ack")

    def set_out(self, other: bool = True) -> None:
        """Starts towards the goal; to and fro between the scenario's goal and its start."""
        self._goal = (self._goal + 1) % 2 if other else self._goal
        shape = (self.scenario.goal, self.scenario.start)[self._goal]
        if self.task_state is not None and self.task_state.state == RUNNING:
            self.client.request_task(TaskRequest.STOP)
        self.client.request_task(
            TaskRequest.SET_GOAL, goal=goal_message(self.scenario, shape, self.client)
        )
        self.client.request_task(TaskRequest.START)

    def until_fast(self, speed: float) -> None:
        """Until the gripper moves that fast [m/s]."""

        def fast() -> bool:
            arm = next((a for a in self.arms.arms if a.arm == SIDE), None)
            return arm is not None and sum(v * v for v in arm.linear_velocity) > speed**2

        self.until(fast, 15.0, f"the arm does not reach {speed} m/s")

    def until_reached(self, seconds: float = 45.0) -> int:
        """Until the controller says so; how often the cell held again on the way.

        A machine that is too busy makes it hold; a person looks, and goes on.
        """
        held = 0
        end = time.monotonic() + seconds
        while True:
            self.until(
                lambda: self.arms.needs_acknowledgement or self._task_is(REACHED),
                max(end - time.monotonic(), 0.0),
                "the goal was not reached",
            )
            if self._task_is(REACHED):
                return held
            held += 1
            self.acknowledge()
            if not self._task_is(RUNNING):
                self.set_out(other=False)

    def _task_is(self, state: int) -> bool:
        return self.task_state is not None and self.task_state.state == state


def until(condition: Callable[[], bool], seconds: float, otherwise: str) -> None:
    """Waits for a condition; raises Missing."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            raise Missing(otherwise)
        time.sleep(TICK)


def _environment() -> dict[str, str]:
    return {**os.environ, **LIBRARY_ENVIRONMENT}


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]

"""Launcher of a stack: starts its processes, watches them, restarts the dead, ends all.

The launcher holds the hub of the bus, through which the processes find each other. A process is
ready when its first health message comes. A process that dies is started again, after a delay that
doubles; three deaths within a minute end the stack. A restarted gateway never arms by itself.

On request, the launcher ends all processes and starts those of another scenario, or runs a campaign
beside them. Requests are answered in a thread of their own, one after the other: however long a
file takes, the processes are watched meanwhile.
"""

from __future__ import annotations

import selectors
import signal
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from types import FrameType

from lariat.plain_text import plain_text
from shared import topics
from shared.bus import Bus
from shared.messages import (
    RUNNING,
    ArmStates,
    ProcessState,
    StackState,
    TaskRequest,
    TaskState,
)
from shared.runtime.clock import SystemClock
from stack.launcher.console import ProcessConsole
from stack.launcher.fork_server import ForkServer
from stack.launcher.process import Process, Program
from stack.scenario_manager.scenario_manager import CellCondition, ScenarioManager

WATCH_PERIOD = 0.05
"""Longest time between two checks of all processes [s]."""
FROZEN_AGE = 2.0
"""Age of the last health message, beyond the longest step, at which a process is frozen [s]."""
MAX_DEATHS = 3
"""Deaths within `DEATH_WINDOW` that end the stack."""
DEATH_WINDOW = 60.0
"""Duration over which deaths count [s]."""
FIRST_RESTART_DELAY = 0.25
"""Delay of the first restart [s]; it doubles with each death in the window."""
HOLD_TIMEOUT = 0.6
"""Longest wait for the arms to stand before the processes are ended [s]."""
STAGE_TIMEOUT = 1.5
"""Longest wait for the processes of one stage to end before they are killed [s]."""
SAVE_TIMEOUT = 4.0
"""Longest wait for a further line of a process that saves data while it ends [s]."""
STOP_TIMEOUT = 9.5
"""Longest time until all processes are killed that have not ended [s]."""
EXIT_BAD_INPUT = 2
"""Exit code of a process that refuses its scenario: it is not started again."""


class Launcher:
    """Launcher of the processes of one stack."""

    def __init__(
        self,
        programs: Sequence[Program],
        bus: Bus,
        console: ProcessConsole,
        switch: ScenarioManager | None = None,
        fork_server: ForkServer | None = None,
    ) -> None:
        """Prepare the processes; without a switch there is one scenario."""
        self._fork_server = fork_server
        self._processes = [Process(program, fork_server) for program in programs]
        self._switch = switch
        self._last_lines: dict[str, str] = {}
        """Last line that each process has printed, by its name."""
        self._by_pid: dict[int, Process] = {}
        self._console = console
        self._clock = SystemClock()
        self._health = bus.subscribe(topics.HEALTH)
        self._task = bus.subscribe(topics.TASK_STATE)
        self._arm = bus.subscribe(topics.ARM_STATE)
        self._stack_requests = bus.subscribe(topics.STACK_REQUEST)
        self._answering = ThreadPoolExecutor(1, "scenario requests")
        self._answers: list[Future[None]] = []
        """Answers to the requests that were taken last."""
        self._newest_task: TaskState | None = None
        self._newest_arms: ArmStates | None = None
        self._requests = bus.publisher(topics.TASK_REQUEST)
        self._stack = bus.publisher(topics.STACK_STATE)
        self._campaign = bus.publisher(topics.CAMPAIGN_STATE)
        self._published = 0.0
        self._selector = selectors.DefaultSelector()
        self._signals = self._suspensions = 0
        self._started = 0.0
        self._starting = True
        """Whether not all processes of the present scenario have been ready yet."""

    def run(self, when_ready: Callable[[float], None]) -> int:
        """Start all processes, keep them until a signal or a final failure, and end them.

        Returns 0 after a signal, else the exit code of the process that failed for good.
        """
        handled = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP)
        former = [signal.signal(number, self._signal) for number in handled]
        self._started = time.monotonic()
        try:
            for process in self._processes:
                self._start(process)
            return self._watch(when_ready)
        finally:
            self._answering.shutdown(wait=False, cancel_futures=True)
            self._stop()
            self._answering.shutdown()
            if self._switch is not None:
                self._switch.close()
            for number, handler in zip(handled, former, strict=True):
                signal.signal(number, handler)

    def _signal(self, number: int, frame: FrameType | None) -> None:
        if number == signal.SIGTSTP:
            self._suspensions += 1
            return
        self._signals += 1
        if self._signals > 1:
            self._kill_all()

    def _watch(self, when_ready: Callable[[float], None]) -> int:
        waiting = True
        while not self._signals:
            if self._suspensions:
                # Arms would go on, and nobody would start a process again that dies.
                text = "Ctrl-Z is refused: the cell needs its launcher; Ctrl-C stops all"
                self._console.print_line("lariat", text, "warning")
                self._suspensions = 0
            self._poll_outputs()
            now = time.monotonic()
            for process in self._processes:
                code = self._supervise(process, now)
                if code is None:
                    continue
                if not self._return_to_former(process):
                    return code
                break
            if all(p.state == "ready" for p in self._processes):
                self._prioritize()
                if waiting:
                    when_ready(now - self._started)
                elif self._switch is not None:
                    self._switch.confirm_ready()
                waiting = False
            self._handle_requests()
            if now - self._published >= 1.0:
                self._publish()
        return 0

    def _prioritize(self) -> None:
        """Give the processes their priorities, once after the start of a whole stack."""
        if self._starting:
            for process in self._processes:
                process.prioritize()
        self._starting = False

    def _handle_requests(self) -> None:
        """Answer requests, go on with a campaign, start a scenario whose check has ended."""
        if self._switch is None:
            return
        if not all(answer.done() for answer in self._answers):
            return
        for answer in self._answers:
            answer.result()
        with self._switch.door.guard("a trial of a campaign") as outcome:
            if self._switch.campaigns.poll() or self._answers:
                self._publish()
        if outcome.refusal:
            self._switch.campaigns.close()
        self._answers = []
        if self._switch.poll(self._condition):
            self._start_cell(self._switch)
            return
        requests = [item.message for _, item in self._stack_requests.take()]
        condition = self._condition() if requests else CellCondition()
        submit, handle = self._answering.submit, self._switch.handle
        self._answers = [submit(handle, request, condition) for request in requests]

    def _condition(self) -> CellCondition:
        if tasks := self._task.take():
            self._newest_task = tasks[-1][1].message
        if arms := self._arm.take():
            self._newest_arms = arms[-1][1].message
        return CellCondition(self._newest_task, self._newest_arms)

    def _start_cell(self, switch: ScenarioManager) -> None:
        """End the processes of the present scenario and start those of another one."""
        self._console.print_line("lariat", f"starting {plain_text(switch.name)}")
        self._publish()
        self._end_processes()
        if self._signals:
            return
        self._newest_task = self._newest_arms = None
        self._starting = True
        self._processes = [Process(program, self._fork_server) for program in switch.programs]
        for process in self._processes:
            self._start(process)

    def _return_to_former(self, process: Process) -> bool:
        """Start the former scenario again after a process of a new one has failed for good."""
        if self._switch is None:
            return False
        name = process.program.name
        line = self._last_lines.get(name, "").removeprefix(f"{name}: ")
        reason = f"{name}: {line or describe_exit(process.exit_code)}"
        if not self._switch.take_failure(reason):
            return False
        self._start_cell(self._switch)
        return True

    def _poll_outputs(self) -> None:
        """Wait for output for one period, print it, and read health messages."""
        for key, _ in self._selector.select(WATCH_PERIOD):
            self._print(key.data)
        for _, item in self._health.take():
            process = self._by_pid.get(item.message.process)
            if process and process.running:
                process.last_health = time.monotonic()
                process.longest_step = 1e-3 * item.message.longest_step_ms
                if process.state in ("starting", "frozen"):
                    if process.state == "frozen":
                        self._console.print_line(process.program.name, "answers again", "warning")
                    if not self._starting:
                        process.prioritize()
                    self._change(process, "ready")

    def _print(self, process: Process) -> None:
        for line in map(plain_text, process.lines()):
            self._console.print_line(process.program.name, line)
            if process.program.saves:
                process.last_line = time.monotonic()
            self._last_lines[process.program.name] = line
            ready_line = process.program.ready_line
            if ready_line and ready_line in line and process.state == "starting":
                self._change(process, "ready")

    def _supervise(self, process: Process, now: float) -> int | None:
        """Restart the process if due and notice its death; an exit code when the stack must end."""
        if process.state == "restarting":
            if now >= process.restart_at:
                process.restarts += 1
                self._start(process)
            return None
        code = process.poll()
        if code is not None:
            return self._handle_death(process, code, now)
        if process.state == "ready" and not process.program.ready_line:
            silence = now - process.last_health
            if silence > FROZEN_AGE + process.longest_step:
                text = f"frozen: no health for {silence:.1f} s"
                self._console.print_line(process.program.name, text, "error")
                self._change(process, "frozen")
        return None

    def _handle_death(self, process: Process, code: int, now: float) -> int | None:
        name = process.program.name
        self._print(process)
        self._selector.unregister(process.output)
        del self._by_pid[process.pid]
        process.close()
        process.deaths = [t for t in process.deaths if now - t < DEATH_WINDOW] + [now]
        count = len(process.deaths)
        refused = code == EXIT_BAD_INPUT and process.state == "starting" and not process.restarts
        if refused or count >= MAX_DEATHS:
            self._change(process, "dead")
            if not refused:
                text = (
                    f"died ({describe_exit(code)}), {count} times within {DEATH_WINDOW:.0f} s: "
                    "giving up"
                )
                self._console.print_line(name, text, "error")
            return code or 1
        delay = FIRST_RESTART_DELAY * 2 ** (count - 1)
        process.restart_at = now + delay
        text = f"died ({describe_exit(code)}); restarting in {delay:g} s"
        self._console.print_line(name, text, "error")
        self._change(process, "restarting")
        return None

    def _start(self, process: Process) -> None:
        process.start()
        self._by_pid[process.pid] = process
        self._selector.register(process.output, selectors.EVENT_READ, process)
        self._change(process, "starting")

    def _change(self, process: Process, state: str) -> None:
        process.state = state
        self._publish()

    def _publish(self) -> None:
        self._published = time.monotonic()
        state = StackState(
            stamp=self._clock.now(),
            processes=[
                ProcessState(
                    service=p.program.name,
                    state=p.state,
                    restarts=p.restarts,
                    exit_code=p.exit_code,
                )
                for p in self._processes
            ],
        )
        if self._switch is not None:
            self._switch.fill(state)
            if (campaign := self._switch.campaigns.state) is not None:
                campaign.stamp = state.stamp
                self._campaign.put(campaign)
        self._stack.put(state)

    def _stop(self) -> None:
        """End all processes and say so."""
        begun = time.monotonic()
        self._console.print_line("lariat", "stopping")
        self._end_processes()
        self._publish()
        self._console.print_line("lariat", f"stopped in {time.monotonic() - begun:.1f} s")

    def _end_processes(self) -> None:
        """End all processes: hold the arms, then end stage by stage, at last by force."""
        deadline = time.monotonic() + STOP_TIMEOUT
        self._hold()
        for stage in sorted({p.program.stage for p in self._processes}):
            group = [p for p in self._processes if p.program.stage == stage and p.running]
            for process in group:
                process.last_line = time.monotonic()
                process.send(signal.SIGTERM)
            while time.monotonic() < deadline and any(_is_waited_for(p) for p in group):
                self._print_while_stopping()
            for process in group:
                if process.running:
                    name = process.program.name
                    self._console.print_line(name, "does not end; killed", "warning")
                    process.send(signal.SIGKILL)
        self._kill_all()
        for process in self._processes:
            while process.running:
                time.sleep(0.005)
            if process.pid:
                self._print(process)
                self._selector.unregister(process.output)
                process.close()
            if process.state != "dead":
                process.state = "stopped"
        self._by_pid.clear()

    def _print_while_stopping(self) -> None:
        for key, _ in self._selector.select(0.01):
            self._print(key.data)
        time.sleep(0.005)

    def _hold(self) -> None:
        """Stop a running task, so that the arms stand still before their gateway ends."""
        task = self._condition().task
        if task is None or task.state != RUNNING:
            return
        request = f"lariat-stop-{time.monotonic_ns()}"
        self._requests.put(
            TaskRequest(id=request, stamp=self._clock.now(), action=TaskRequest.STOP)
        )
        self._arm.take()
        deadline = time.monotonic() + HOLD_TIMEOUT
        answered = False
        while time.monotonic() < deadline and self._signals < 2:
            self._print_while_stopping()
            answered |= any(i.message.last_request == request for _, i in self._task.take())
            arms = [i.message for _, i in self._arm.take()]
            if answered and arms and arms[-1].mode != ArmStates.MOVING and not arms[-1].braking:
                return

    def _kill_all(self) -> None:
        for process in self._processes:
            process.send(signal.SIGKILL)


def _is_waited_for(process: Process) -> bool:
    """Whether a process that was told to end may go on."""
    timeout = SAVE_TIMEOUT if process.program.saves else STAGE_TIMEOUT
    return process.running and time.monotonic() - process.last_line < timeout


def describe_exit(code: int) -> str:
    """Description of an exit code as a shell counts it."""
    if code > 128:
        try:
            return f"killed by {signal.Signals(code - 128).name}"
        except ValueError:
            pass
    return f"exit code {code}"

"""Keeps the processes of a stack: starts them, watches them, replaces the dead, ends all.

The launcher holds the hub of the bus, so that the others find each other. A process is ready when
its first health comes. One that dies is started again, later each time; three deaths within a
minute end the stack. A restarted gateway never arms by itself.
"""

from __future__ import annotations

import selectors
import signal
import time
from collections.abc import Callable, Sequence
from types import FrameType

from shared import topics
from shared.bus import Bus
from shared.clock import SystemClock
from shared.messages import (
    RUNNING,
    ArmStates,
    ProcessState,
    StackState,
    TaskRequest,
)
from stack.launcher.console import Lines
from stack.launcher.process import Process, Program

TICK = 0.05
"""Longest time between two looks at everything [s]."""
FROZEN = 2.0
"""Age of health at which a process counts as frozen [s], on top of what a step may last."""
DEATHS = 3
DEATH_WINDOW = 60.0
"""So many deaths within so many seconds end the stack."""
FIRST_DELAY = 0.25
"""Before the first restart [s]; doubles with each death in the window."""
HOLD_PATIENCE = 0.6
"""Longest wait for the arms to stand before the processes are ended [s]."""
STAGE_PATIENCE = 0.7
"""Longest wait for the processes of one stage to end before they are killed [s]."""
BAD_INPUT = 2


class Launcher:
    """The processes of one stack."""

    def __init__(self, programs: Sequence[Program], bus: Bus, lines: Lines) -> None:
        self._processes = [Process(program) for program in programs]
        self._by_pid: dict[int, Process] = {}
        self._lines = lines
        self._clock = SystemClock()
        self._health = bus.subscribe(topics.HEALTH)
        self._task = bus.subscribe(topics.TASK_STATE)
        self._arm = bus.subscribe(topics.ARM_STATE)
        self._requests = bus.publisher(topics.TASK_REQUEST)
        self._stack = bus.publisher(topics.STACK_STATE)
        self._published = 0.0
        self._selector = selectors.DefaultSelector()
        self._signals = 0
        self._started = 0.0

    def run(self, when_ready: Callable[[float], None]) -> int:
        """Starts everything, keeps it until a signal comes or it fails for good, and ends it.

        Args:
            when_ready: Called once with the seconds that it took until all were ready.

        Returns:
            0 after a signal; otherwise the exit code of the process that could not be kept.
        """
        handled = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
        former = [signal.signal(number, self._signal) for number in handled]
        self._started = time.monotonic()
        try:
            for process in self._processes:
                self._start(process)
            return self._watch(when_ready)
        finally:
            self._stop()
            for number, handler in zip(handled, former, strict=True):
                signal.signal(number, handler)

    def _signal(self, number: int, frame: FrameType | None) -> None:
        self._signals += 1
        if self._signals > 1:
            self._kill_all()

    def _watch(self, when_ready: Callable[[float], None]) -> int:
        waiting = True
        while not self._signals:
            self._look()
            now = time.monotonic()
            for process in self._processes:
                code = self._tend(process, now)
                if code is not None:
                    return code
            if waiting and all(p.state == "ready" for p in self._processes):
                waiting = False
                when_ready(now - self._started)
            if now - self._published >= 1.0:
                self._publish()
        return 0

    def _look(self) -> None:
        """Waits a moment for lines, prints them, and reads the bus."""
        for key, _ in self._selector.select(TICK):
            self._print(key.data)
        for _, item in self._health.take():
            process = self._by_pid.get(item.message.process)
            if process and process.running:
                process.heard = time.monotonic()
                process.longest_step = 1e-3 * item.message.longest_step_ms
                if process.state in ("starting", "frozen"):
                    if process.state == "frozen":
                        self._lines.say(process.program.name, "answers again", "warning")
                    self._change(process, "ready")

    def _print(self, process: Process) -> None:
        for line in process.lines():
            self._lines.say(process.program.name, line)
            ready_line = process.program.ready_line
            if ready_line and ready_line in line and process.state == "starting":
                self._change(process, "ready")

    def _tend(self, process: Process, now: float) -> int | None:
        """Restarts, notices death and frost; an exit code when the stack cannot go on."""
        if process.state == "restarting":
            if now >= process.restart_at:
                process.restarts += 1
                self._start(process)
            return None
        code = process.ended()
        if code is not None:
            return self._bury(process, code, now)
        if process.state == "ready" and not process.program.ready_line:
            silence = now - process.heard
            if silence > FROZEN + process.longest_step:
                text = f"frozen: no health for {silence:.1f} s"
                self._lines.say(process.program.name, text, "error")
                self._change(process, "frozen")
        return None

    def _bury(self, process: Process, code: int, now: float) -> int | None:
        name = process.program.name
        self._print(process)
        self._selector.unregister(process.output)
        del self._by_pid[process.pid]
        process.forget()
        process.deaths = [t for t in process.deaths if now - t < DEATH_WINDOW] + [now]
        count = len(process.deaths)
        refused = code == BAD_INPUT and process.state == "starting" and not process.restarts
        if refused or count >= DEATHS:
            self._change(process, "dead")
            if not refused:
                text = (
                    f"died ({meaning(code)}), {count} times within {DEATH_WINDOW:.0f} s: giving up"
                )
                self._lines.say(name, text, "error")
            return code or 1
        delay = FIRST_DELAY * 2 ** (count - 1)
        process.restart_at = now + delay
        self._lines.say(name, f"died ({meaning(code)}); restarting in {delay:g} s", "error")
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
        self._stack.put(
            StackState(
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
        )

    def _stop(self) -> None:
        """Ends all processes: first the motion, then stage by stage, at last by force."""
        begun = time.monotonic()
        self._lines.say("lariat", "stopping")
        self._hold()
        for stage in sorted({p.program.stage for p in self._processes}):
            group = [p for p in self._processes if p.program.stage == stage and p.running]
            for process in group:
                process.send(signal.SIGTERM)
            deadline = time.monotonic() + STAGE_PATIENCE
            while any(p.running for p in group) and time.monotonic() < deadline:
                self._look_while_stopping()
            for process in group:
                if process.running:
                    self._lines.say(process.program.name, "does not end; killed", "warning")
                    process.send(signal.SIGKILL)
        self._kill_all()
        for process in self._processes:
            while process.running:
                time.sleep(0.005)
            if process.pid:
                self._print(process)
                process.forget()
            if process.state != "dead":
                process.state = "stopped"
        self._publish()
        self._lines.say("lariat", f"stopped in {time.monotonic() - begun:.1f} s")

    def _look_while_stopping(self) -> None:
        for key, _ in self._selector.select(0.01):
            self._print(key.data)
        time.sleep(0.005)

    def _hold(self) -> None:
        """Has a running task stopped, so that the arms stand before their gateway goes."""
        running = [i.message.state == RUNNING for _, i in self._task.take()]
        if not (running and running[-1]):
            return
        request = f"lariat-stop-{time.monotonic_ns()}"
        self._requests.put(
            TaskRequest(id=request, stamp=self._clock.now(), action=TaskRequest.STOP)
        )
        self._arm.take()
        deadline = time.monotonic() + HOLD_PATIENCE
        answered = False
        while time.monotonic() < deadline and self._signals < 2:
            self._look_while_stopping()
            answered |= any(i.message.last_request == request for _, i in self._task.take())
            arms = [i.message for _, i in self._arm.take()]
            if answered and arms and arms[-1].mode != ArmStates.MOVING and not arms[-1].braking:
                return

    def _kill_all(self) -> None:
        for process in self._processes:
            process.send(signal.SIGKILL)


def meaning(code: int) -> str:
    """An exit code in words."""
    if code > 128:
        try:
            return f"killed by {signal.Signals(code - 128).name}"
        except ValueError:
            pass
    return f"exit code {code}"

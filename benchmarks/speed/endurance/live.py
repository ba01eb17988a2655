"""Runs back to back in a live stack, with pages open."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from types import TracebackType

from benchmarks.child_processes import child_processes
from benchmarks.live_stack import LiveStack
from benchmarks.speed.camera_to_arm import Latency, latencies
from benchmarks.speed.endurance.pages import OpenPages
from benchmarks.speed.endurance.samples import Sample, sample_of
from lariat.scenario import load
from services.recorder.retention import IDLE_ENDING
from shared import topics
from shared.messages import FAILED, IDLE, REACHED, ArmCommand, ArmStates, Health, TaskRequest
from shared.recording import Recording
from stack.client import RequestFailed
from stack.credentials.local_secret import find_local_secret
from stack.launcher import module_entry

SAMPLE_PERIOD = 10.0
"""Time between two samples [s]."""
RESET_TIMEOUT = 10.0
"""Longest wait for a reset [s]."""
HOSTILE_DURATION = 86_400.0
"""Time after which the publisher of hostile messages would end by itself [s]."""
POLL_PERIOD = 0.05
"""Time between two looks at the state of the task [s]."""
RECORDINGS = "recordings"
"""Folder of the recordings in that of the stack."""
LATENCY_RECORDINGS = 5
"""Largest number of recordings that latencies are read from."""


class LiveOperation:
    """`lariat up` and a person who starts a run, resets it and starts the next one."""

    def __init__(self, scenario: Path, pages: int, hostile_rate: float = 0.0) -> None:
        """Create an operation that begins with its `with` block.

        Args:
            scenario: The scenario.
            pages: Number of pages that are open.
            hostile_rate: Hostile messages on the bus in a second [Hz].
        """
        self._scenario, self._page_count, self._hostile_rate = scenario, pages, hostile_rate
        self._time_limit = load(scenario).run.time_limit
        self._health: dict[str, Health] = {}
        self._pages: OpenPages | None = None
        self._resources = ExitStack()
        self.runs = 0
        """Number of runs that reached their goal."""
        self.failures: list[str] = []
        """Runs that did not, in words."""
        self.holds: list[str] = []
        """Stops that had to be acknowledged: when, and why."""
        self._begun = time.monotonic()

    def __enter__(self) -> LiveOperation:
        """Start stack and pages."""
        stack = self._stack = self._resources.enter_context(LiveStack(self._scenario))
        self._client = self._resources.enter_context(stack.connect())
        bus = self._client.bus
        self._arm, self._task = bus.subscribe(topics.ARM_STATE), bus.subscribe(topics.TASK_STATE)
        self._healths = bus.subscribe(topics.HEALTH)
        if self._page_count:
            self._pages = OpenPages(stack.address, self._page_count)
            self._resources.callback(self._pages.close)
        if self._hostile_rate:
            self._start_hostile_publisher(stack.hub, stack.namespace)
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """End everything."""
        self._resources.close()

    def run_until(self, minutes: float) -> Iterator[list[Sample]]:
        """Run back to back for a time [min], and yield samples of all processes."""
        begun = self._begun = sampled = time.monotonic()
        while (now := time.monotonic()) - begun < 60.0 * minutes:
            self._run_once()
            if now - sampled >= SAMPLE_PERIOD:
                sampled = now
                yield list(self._samples((now - begun) / 60.0))

    def _samples(self, minutes: float) -> Iterator[Sample]:
        self._update()
        yield sample_of("lariat up", self._stack.pid, minutes)
        for name, health in sorted(self._health.items()):
            with suppress(OSError):  # It may just be restarted.
                steps = health.step_p99_ms, health.period_ms
                yield sample_of(name, health.process, minutes, *steps)
        stepping = {health.process for health in self._health.values()}
        for pid, name in sorted(child_processes(self._stack.pid).items()):
            if pid not in stepping:
                with suppress(OSError):
                    yield sample_of(name, pid, minutes)

    def _run_once(self) -> None:
        try:
            self._client.request_task(TaskRequest.START)
            state, reason = self._wait((REACHED, FAILED), self._time_limit + RESET_TIMEOUT)
            self._client.request_task(TaskRequest.RESET)
            self._wait((IDLE,), RESET_TIMEOUT)
        except RequestFailed as error:
            self.failures.append(str(error))
            self._go_on()
            return
        if state == REACHED:
            self.runs += 1
        else:
            self.failures.append(reason or "the time limit has passed")

    def _wait(self, states: tuple[int, ...], seconds: float) -> tuple[int, str]:
        """Wait for a state of the task, acknowledging stops; return the last one, with reason."""
        deadline = time.monotonic() + seconds
        state, reason = -1, ""
        while time.monotonic() < deadline:
            self._update()
            for _, item in self._task.take():
                state, reason = item.message.state, item.message.reason
            if state in states:
                break
            arms = [item.message for _, item in self._arm.take()]
            if arms and arms[-1].needs_acknowledgement:
                self._go_on()
            time.sleep(POLL_PERIOD)
        return state, reason

    def _go_on(self) -> None:
        """Acknowledge a stop and resume, as a person would on a machine that is too busy."""
        with suppress(RequestFailed):
            state: ArmStates = self._client.newest_arm_state()
            if state.needs_acknowledgement:
                minutes = (time.monotonic() - self._begun) / 60.0
                self.holds.append(f"held after {minutes:.1f} min: {state.reason}")
                self._client.command_arms(ArmCommand.ACKNOWLEDGE)
            time.sleep(POLL_PERIOD)
            self._client.command_arms(ArmCommand.RESUME)

    def latencies(self) -> list[Latency]:
        """Latencies from camera to arm, of the images of the newest closed recordings."""
        files = sorted((self._stack.folder / RECORDINGS).glob("*.mcap"))
        runs = [path for path in files if not path.name.endswith(IDLE_ENDING)]
        # The last one is still being written.
        return latencies(Recording.open(path) for path in runs[:-1][-LATENCY_RECORDINGS:])

    @property
    def ended_pages(self) -> str:
        """Number of pages whose connection has ended, with the last reason; empty without one."""
        if self._pages is None or not self._pages.closed:
            return ""
        return f"{self._pages.closed} pages ended {self._pages.reason}".rstrip()

    @property
    def refused(self) -> int:
        """Messages that the services have refused so far."""
        self._update()
        return sum(health.refused for health in self._health.values())

    def _start_hostile_publisher(self, hub: str, namespace: str) -> None:
        options = ["--hub", hub, "--namespace", namespace, "--rate", str(self._hostile_rate)]
        options += ["--duration", str(HOSTILE_DURATION)]
        if secret := find_local_secret((hub,)):
            options += ["--settings", str(secret)]
        publisher = subprocess.Popen(
            [
                sys.executable,
                *module_entry.command("benchmarks.faults.fuzz.hostile_publisher", *options),
            ],
            stdout=subprocess.DEVNULL,
        )

        def end() -> None:
            publisher.terminate()
            publisher.wait()

        self._resources.callback(end)

    def _update(self) -> None:
        for _, item in self._healths.take():
            self._health[item.message.service] = item.message
